//! PCD of the Point Cloud Library: text, binary and compressed.

use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::Path;

use pcd_rs::{DataKind, DynReader, DynRecord, Field, PcdMeta};

use super::{MapCloud, expect_room};

/// The highest compression ratio of LZF: a back reference of 3 bytes encodes at most 264 bytes.
const MAX_COMPRESSED: u64 = 88;

/// Whether a file begins like a PCD file: comments, then the version.
pub(super) fn is_pcd(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'));
    first.is_some_and(|line| line.starts_with("VERSION "))
}

/// Reads the points. Like other readers, ignores the position of the sensor (`VIEWPOINT`).
pub(super) fn read(path: &Path, size: u64) -> Result<MapCloud, String> {
    let text = |error: pcd_rs::Error| error.to_string();
    let io = |error: std::io::Error| error.to_string();
    let mut reader = BufReader::new(File::open(path).map_err(io)?);
    let meta = PcdMeta::from_reader(&mut reader).map_err(text)?;
    let record = expect_fields(&meta)?;
    if meta.data == DataKind::BinaryCompressed {
        let mut lengths = [0; 8];
        reader.read_exact(&mut lengths).map_err(io)?;
        let [compressed, whole] =
            [0, 4].map(|at| u64::from(u32::from_le_bytes([0, 1, 2, 3].map(|i| lengths[at + i]))));
        let promised = meta.num_points.checked_mul(record);
        if compressed > size || whole / MAX_COMPRESSED > compressed || promised != Some(whole) {
            return Err(format!(
                "{} points of {record} bytes expected, but {compressed} bytes that make {whole} are \
                 announced in a file of {size}",
                meta.num_points
            ));
        }
    } else {
        expect_room(meta.num_points, record, size)?;
    }
    let place = |axis| {
        let mut fields = meta.field_defs.iter().filter(|field| !field.is_padding());
        let found = fields.position(|field| field.name == axis);
        found.ok_or_else(|| format!("a field `{axis}` expected"))
    };
    let axes = [place("x")?, place("y")?, place("z")?];
    let reader = BufReader::new(File::open(path).map_err(io)?);
    let records: DynReader<_> = DynReader::from_reader(reader).map_err(text)?;
    let mut cloud = MapCloud::default();
    for (index, record) in records.enumerate() {
        let DynRecord(fields) = record.map_err(|error| format!("point {index}: {error}"))?;
        cloud.add(axes.map(|axis| fields.get(axis).and_then(number).unwrap_or(f64::NAN)))?;
    }
    Ok(cloud)
}

/// Checks the layout, and returns the smallest size of a point \[bytes\].
fn expect_fields(meta: &PcdMeta) -> Result<u64, String> {
    let mut record: u64 = 0;
    for field in &meta.field_defs {
        let bytes = match meta.data {
            // A digit and a separator.
            DataKind::Ascii => 2,
            _ => field.kind.byte_size() as u64,
        };
        let bytes = bytes.checked_mul(field.count);
        record = bytes
            .and_then(|bytes| record.checked_add(bytes))
            .ok_or_else(|| format!("a count expected, `{}` has {}", field.name, field.count))?;
    }
    Ok(record)
}

fn number(field: &Field) -> Option<f64> {
    match field {
        Field::F32(values) => values.first().map(|value| f64::from(*value)),
        Field::F64(values) => values.first().copied(),
        Field::I8(values) => values.first().map(|value| f64::from(*value)),
        Field::I16(values) => values.first().map(|value| f64::from(*value)),
        Field::I32(values) => values.first().map(|value| f64::from(*value)),
        Field::U8(values) => values.first().map(|value| f64::from(*value)),
        Field::U16(values) => values.first().map(|value| f64::from(*value)),
        Field::U32(values) => values.first().map(|value| f64::from(*value)),
        Field::I64(_) | Field::U64(_) => None,
    }
}
