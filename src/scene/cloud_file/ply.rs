//! PLY: text, and binary in both byte orders.
//!
//! A library reads the header. We read the elements ourselves: the library refuses `nan` in text, and believes the
//! length of each list.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, PropertyType, ScalarType};
use posescope_core::files;

use super::super::lines::excerpt;
use super::{Collector, MapCloud, expect_room};

/// Reads the vertices one by one; other properties and other elements are skipped.
pub(super) fn read(path: &Path, size: u64) -> Result<MapCloud, String> {
    let text = |error: std::io::Error| error.to_string();
    let mut reader = BufReader::new(files::open(path).map_err(text)?);
    let header = Parser::<DefaultElement>::new().read_header(&mut reader).map_err(text)?;
    let mut elements = Elements { reader, encoding: header.encoding, bytes: Vec::new() };
    for element in header.elements.values() {
        let least = least_bytes(element, header.encoding);
        expect_room(element.count as u64, least, size)?;
        let axes =
            ["x", "y", "z"].map(|axis| element.properties.keys().position(|name| name == axis));
        if element.name != "vertex" {
            elements.skip(element)?;
            continue;
        }
        let [Some(x), Some(y), Some(z)] = axes else {
            let missing = ["x", "y", "z"].iter().zip(axes).find(|(_, at)| at.is_none());
            let axis = missing.map_or("x", |(axis, _)| axis);
            return Err(format!("a property `{axis}` of the vertices expected"));
        };
        let mut cloud = Collector::default();
        elements.each(element, [x, y, z], |point| cloud.add(point))?;
        return Ok(cloud.finish());
    }
    Err("`element vertex` expected".to_owned())
}

/// The elements of a file, in their order.
struct Elements {
    reader: BufReader<File>,
    encoding: Encoding,
    bytes: Vec<u8>,
}

impl Elements {
    fn skip(&mut self, element: &ElementDef) -> Result<(), String> {
        self.each(element, [usize::MAX; 3], |_| Ok(()))
    }

    /// Hands over the numbers at three positions among the properties of each element.
    fn each(
        &mut self,
        element: &ElementDef,
        places: [usize; 3],
        mut take: impl FnMut([f64; 3]) -> Result<(), String>,
    ) -> Result<(), String> {
        let kinds: Vec<&PropertyType> =
            element.properties.values().map(|property| &property.data_type).collect();
        if let (true, Some(kinds)) = (self.encoding != Encoding::Ascii, scalars(&kinds)) {
            return self.each_record(element, &kinds, places, take);
        }
        for index in 0..element.count {
            let read = match self.encoding {
                Encoding::Ascii => self.text_element(&kinds, places),
                _ => self.binary_element(&kinds, places),
            };
            let numbers = read.map_err(|why| format!("{} {index}: {why}", element.name))?;
            take(numbers)?;
        }
        Ok(())
    }

    /// The same of binary elements of one size, which are read as a whole.
    fn each_record(
        &mut self,
        element: &ElementDef,
        kinds: &[&ScalarType],
        places: [usize; 3],
        mut take: impl FnMut([f64; 3]) -> Result<(), String>,
    ) -> Result<(), String> {
        let start = |at: usize| kinds[..at].iter().map(|kind| bytes_of(kind) as usize).sum();
        let axes: [Option<(usize, Decode)>; 3] = places
            .map(|at| Some((start(at.min(kinds.len())), decoder(kinds.get(at)?, self.encoding))));
        let mut record = vec![0; start(kinds.len())];
        for index in 0..element.count {
            self.reader.read_exact(&mut record).map_err(|_| {
                format!("{} {index}: more bytes expected, the file is cut off", element.name)
            })?;
            let number = |(at, decode): (usize, Decode)| decode(&record[at..]);
            take(axes.map(|axis| axis.map_or(f64::NAN, number)))?;
        }
        Ok(())
    }

    fn text_element(
        &mut self,
        kinds: &[&PropertyType],
        places: [usize; 3],
    ) -> Result<[f64; 3], String> {
        self.bytes.clear();
        let read = self.reader.read_until(b'\n', &mut self.bytes);
        if read.map_err(|error| error.to_string())? == 0 {
            return Err("one line per element expected, the file is cut off".to_owned());
        }
        let line = std::str::from_utf8(&self.bytes).map_err(|_| "a line of numbers expected")?;
        let mut words = line.split_ascii_whitespace();
        let mut next = || words.next().ok_or("more numbers in its line expected");
        let mut numbers = [f64::NAN; 3];
        for (at, kind) in kinds.iter().enumerate() {
            let word = next()?;
            match kind {
                PropertyType::Scalar(_) => {
                    if let Some(axis) = places.iter().position(|place| *place == at) {
                        numbers[axis] = word.parse().or_else(|_| no_number(word))?;
                    }
                }
                PropertyType::List(..) => {
                    let length: usize = word.parse().map_err(|_| {
                        format!("the length of a list expected, `{}` found", excerpt(word))
                    })?;
                    for _ in 0..length {
                        next()?;
                    }
                }
            }
        }
        match words.next() {
            Some(word) => Err(format!(
                "{} properties in its line expected, then `{}` found",
                kinds.len(),
                excerpt(word)
            )),
            None => Ok(numbers),
        }
    }

    fn binary_element(
        &mut self,
        kinds: &[&PropertyType],
        places: [usize; 3],
    ) -> Result<[f64; 3], String> {
        let mut numbers = [f64::NAN; 3];
        for (at, kind) in kinds.iter().enumerate() {
            match kind {
                PropertyType::Scalar(kind) => {
                    let value = self.binary_number(kind)?;
                    if let Some(axis) = places.iter().position(|place| *place == at) {
                        numbers[axis] = value;
                    }
                }
                PropertyType::List(length, kind) => {
                    let length = self.binary_number(length)?;
                    if length < 0.0 {
                        return Err(format!("the length of a list expected, {length} found"));
                    }
                    let bytes = (length as u64).saturating_mul(bytes_of(kind));
                    let mut list = (&mut self.reader).take(bytes);
                    let skipped = std::io::copy(&mut list, &mut std::io::sink());
                    if skipped.map_err(|error| error.to_string())? < bytes {
                        return Err(format!(
                            "a list of {length} numbers expected, the file is cut off"
                        ));
                    }
                }
            }
        }
        Ok(numbers)
    }

    fn binary_number(&mut self, kind: &ScalarType) -> Result<f64, String> {
        let mut bytes = [0; 8];
        let bytes = &mut bytes[..bytes_of(kind) as usize];
        self.reader.read_exact(bytes).map_err(|_| "more bytes expected, the file is cut off")?;
        Ok(decoder(kind, self.encoding)(bytes))
    }
}

/// The kinds of an element's properties, if none is a list.
fn scalars<'a>(kinds: &[&'a PropertyType]) -> Option<Vec<&'a ScalarType>> {
    let scalar = |kind: &&'a PropertyType| match kind {
        PropertyType::Scalar(kind) => Some(kind),
        PropertyType::List(..) => None,
    };
    kinds.iter().map(scalar).collect()
}

/// What reads the number in the first of some bytes.
type Decode = fn(&[u8]) -> f64;

fn decoder(kind: &ScalarType, encoding: Encoding) -> Decode {
    fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
        bytes.first_chunk().copied().unwrap_or([0; N])
    }
    /// Of both byte orders.
    macro_rules! decode {
        ($number:ty) => {{
            let (little, big): (Decode, Decode) = (
                |bytes| f64::from(<$number>::from_le_bytes(first(bytes))),
                |bytes| f64::from(<$number>::from_be_bytes(first(bytes))),
            );
            if encoding == Encoding::BinaryBigEndian { big } else { little }
        }};
    }
    match kind {
        ScalarType::Char => decode!(i8),
        ScalarType::UChar => decode!(u8),
        ScalarType::Short => decode!(i16),
        ScalarType::UShort => decode!(u16),
        ScalarType::Int => decode!(i32),
        ScalarType::UInt => decode!(u32),
        ScalarType::Float => decode!(f32),
        ScalarType::Double => decode!(f64),
    }
}

/// NaN for `-nan(ind)` and such, which the libraries of Windows write.
fn no_number(word: &str) -> Result<f64, String> {
    super::text::number(word, false).ok_or_else(|| {
        let hint = if word.contains(',') { "; write decimal points, not commas" } else { "" };
        format!("a number expected, `{}` found{hint}", excerpt(word))
    })
}

/// The smallest size of an element \[bytes\].
fn least_bytes(element: &ElementDef, encoding: Encoding) -> u64 {
    let least = |kind: &PropertyType| match (kind, encoding) {
        // A digit and a separator.
        (_, Encoding::Ascii) => 2,
        (PropertyType::Scalar(kind) | PropertyType::List(kind, _), _) => bytes_of(kind),
    };
    element.properties.values().map(|property| least(&property.data_type)).sum()
}

fn bytes_of(kind: &ScalarType) -> u64 {
    match kind {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}
