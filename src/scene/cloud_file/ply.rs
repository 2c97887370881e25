//! PLY: text, and binary in both byte orders.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyType, ScalarType};

use super::{MapCloud, expect_room};

/// The position of a vertex; other properties are ignored.
#[derive(Default)]
struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, value: Property) {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return,
        };
        self.0[axis] = match value {
            Property::Float(value) => f64::from(value),
            Property::Double(value) => value,
            Property::Int(value) => f64::from(value),
            Property::UInt(value) => f64::from(value),
            Property::Short(value) => f64::from(value),
            Property::UShort(value) => f64::from(value),
            Property::Char(value) => f64::from(value),
            Property::UChar(value) => f64::from(value),
            _ => f64::NAN,
        };
    }
}

/// Reads the vertices one by one. They must be the first element.
pub(super) fn read(path: &Path, size: u64) -> Result<MapCloud, String> {
    let text = |error: std::io::Error| error.to_string();
    let mut reader = BufReader::new(File::open(path).map_err(text)?);
    let parser = Parser::<Vertex>::new();
    let header = parser.read_header(&mut reader).map_err(text)?;
    let Some(vertex) = header.elements.values().next().filter(|e| e.name == "vertex") else {
        return Err("`element vertex` expected as the first element".to_owned());
    };
    for axis in ["x", "y", "z"] {
        if !vertex.properties.contains_key(axis) {
            return Err(format!("a property `{axis}` of the vertices expected"));
        }
    }
    expect_room(vertex.count as u64, least_bytes(vertex, header.encoding)?, size)?;
    let mut cloud = MapCloud::default();
    let mut line = String::new();
    for index in 0..vertex.count {
        let read = match header.encoding {
            Encoding::Ascii => {
                line.clear();
                match reader.read_line(&mut line) {
                    Ok(0) => {
                        return Err(format!("{} vertices expected, {index} found", vertex.count));
                    }
                    Ok(_) => parser.read_ascii_element(&line, vertex),
                    Err(error) => Err(error),
                }
            }
            Encoding::BinaryBigEndian => parser.read_big_endian_element(&mut reader, vertex),
            Encoding::BinaryLittleEndian => parser.read_little_endian_element(&mut reader, vertex),
        };
        let Vertex(position) = read.map_err(|error| format!("vertex {index}: {error}"))?;
        cloud.add(position)?;
    }
    Ok(cloud)
}

/// The smallest size of a vertex \[bytes\]. Lists are refused: clouds have none, and their lengths would have to be
/// checked too.
fn least_bytes(vertex: &ElementDef, encoding: Encoding) -> Result<u64, String> {
    vertex
        .properties
        .values()
        .map(|property| match (&property.data_type, encoding) {
            (PropertyType::List(..), _) => Err(format!(
                "only numbers as properties of the vertices expected, `{}` is a list",
                property.name
            )),
            // A digit and a separator.
            (PropertyType::Scalar(_), Encoding::Ascii) => Ok(2),
            (PropertyType::Scalar(kind), _) => Ok(match kind {
                ScalarType::Char | ScalarType::UChar => 1,
                ScalarType::Short | ScalarType::UShort => 2,
                ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
                ScalarType::Double => 8,
            }),
        })
        .sum()
}
