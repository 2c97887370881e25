//! PCD of the Point Cloud Library: text, binary and compressed.

use std::io::{BufRead, BufReader, Read as _, Seek as _};
use std::path::Path;

use pcd_rs::{DataKind, DynReader, DynRecord, Field, PcdMeta};
use posescope_core::files;

use super::{Collector, MapCloud, expect_room};

/// The highest compression ratio of LZF: a back reference of 3 bytes encodes at most 264 bytes.
const MAX_COMPRESSED: u64 = 88;

/// The longest header \[bytes\].
const MAX_HEADER: u64 = 1 << 20;

/// Whether a file begins like a PCD file: comments, then the version, which some programs leave out.
pub(super) fn is_pcd(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let is_named = text.starts_with("# .PCD");
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'));
    first
        .is_some_and(|line| line.starts_with("VERSION ") || is_named && line.starts_with("FIELDS "))
}

/// Reads the points. Like other readers, ignores the position of the sensor (`VIEWPOINT`).
pub(super) fn read(path: &Path, size: u64) -> Result<MapCloud, String> {
    let text = |error: pcd_rs::Error| error.to_string();
    let io = |error: std::io::Error| error.to_string();
    let mut reader = BufReader::new(files::open(path).map_err(io)?);
    let stated = header(&mut reader).map_err(io)?;
    let body = reader.stream_position().map_err(io)?;
    let start = reader.fill_buf().map_err(io)?;
    let size = size.saturating_sub(body);
    // Fields with a count of 0 take no bytes in files of some programs, and one number in those of others.
    let header = match without_empty_fields(&stated) {
        Some(shorter) if expect_body(&stated, start, size).is_err() => shorter,
        _ => stated,
    };
    expect_body(&header, start, size)?;
    let meta = PcdMeta::from_reader(header.as_bytes()).map_err(text)?;
    let place = |axis| {
        let mut fields = meta.field_defs.iter().filter(|field| !field.is_padding());
        let found = fields.position(|field| field.name == axis);
        found.ok_or_else(|| format!("a field `{axis}` expected"))
    };
    let axes = [place("x")?, place("y")?, place("z")?];
    let records = DynReader::from_reader(header.as_bytes().chain(reader)).map_err(text)?;
    let mut cloud = Collector::default();
    for (index, record) in records.enumerate() {
        let DynRecord(fields) = record.map_err(|error| format!("point {index}: {error}"))?;
        cloud.add(axes.map(|axis| fields.get(axis).and_then(number).unwrap_or(f64::NAN)))?;
    }
    Ok(cloud.finish())
}

/// The lines of the header, the last of which is `DATA`. The library asks for a version.
fn header(reader: &mut impl BufRead) -> std::io::Result<String> {
    let mut header = String::new();
    let mut bytes = Vec::new();
    let mut reader = reader.take(MAX_HEADER);
    while reader.read_until(b'\n', &mut bytes)? > 0 {
        let line = String::from_utf8_lossy(&bytes);
        header += line.trim();
        header.push('\n');
        if line.starts_with("DATA") {
            break;
        }
        bytes.clear();
    }
    if !header.lines().any(|line| line.starts_with("VERSION")) {
        header.insert_str(0, "VERSION 0.7\n");
    }
    Ok(header)
}

/// The header without the fields whose count is 0; `None` if there are none. The library counts them as 1.
fn without_empty_fields(header: &str) -> Option<String> {
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let counts = words(header.lines().find(|line| line.starts_with("COUNT "))?);
    if !counts.iter().any(|count| count == "0") {
        return None;
    }
    let kept = |line: &str| {
        let by_field = ["FIELDS ", "COLUMNS ", "SIZE ", "TYPE ", "COUNT "];
        if !by_field.iter().any(|key| line.starts_with(key)) {
            return line.to_owned() + "\n";
        }
        let words = words(line).into_iter().zip(&counts);
        let kept = words.filter(|(_, count)| *count != "0").map(|(word, _)| word);
        kept.collect::<Vec<_>>().join(" ") + "\n"
    };
    Some(header.lines().map(kept).collect())
}

/// Checks that a body of a size \[bytes\], with these bytes at its start, holds the points of a header.
fn expect_body(header: &str, start: &[u8], size: u64) -> Result<(), String> {
    let meta = PcdMeta::from_reader(header.as_bytes()).map_err(|error| error.to_string())?;
    let record = expect_fields(&meta)?;
    match meta.data {
        DataKind::BinaryCompressed => {
            let lengths =
                start.first_chunk::<8>().ok_or("compressed points expected, none found")?;
            let [compressed, whole] = [0, 4]
                .map(|at| u64::from(u32::from_le_bytes([0, 1, 2, 3].map(|i| lengths[at + i]))));
            let promised = meta.num_points.checked_mul(record);
            if compressed > size || whole / MAX_COMPRESSED > compressed || promised != Some(whole) {
                return Err(format!(
                    "{} points of {record} bytes expected, but {compressed} bytes that make {whole} are \
                     announced in a file of {size}",
                    meta.num_points
                ));
            }
        }
        DataKind::Ascii => {
            expect_room(meta.num_points, record, size)?;
            let first = String::from_utf8_lossy(start);
            let words = first.lines().next().unwrap_or_default().split_whitespace().count() as u64;
            // Two bytes are counted for each word.
            if words != record / 2 && meta.num_points > 0 {
                return Err(format!("{} columns expected, {words} found", record / 2));
            }
        }
        DataKind::Binary => expect_room(meta.num_points, record, size)?,
    }
    Ok(())
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
