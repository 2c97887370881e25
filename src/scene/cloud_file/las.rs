//! LAS and LAZ.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::panic::catch_unwind;
use std::path::Path;

use las::{Header, Reader};
use laz::{LazItem, LazItemType, LazVlr};

use super::{MapCloud, expect_room};

/// Points that are decoded at once.
const BATCH: u64 = 65_536;
/// The least that a point takes before it is compressed \[bytes\].
const LEAST_RECORD: u64 = 20;

/// Reads the points. A panic of the decoder, which counts on sound data, is an error like any other.
pub(super) fn read(path: &Path, size: u64) -> Result<MapCloud, String> {
    catch_unwind(|| decoded(path, size))
        .unwrap_or_else(|_| Err("points that can be decoded expected".to_owned()))
}

fn decoded(path: &Path, size: u64) -> Result<MapCloud, String> {
    let text = |error: las::Error| error.to_string();
    let file = File::open(path).map_err(|error| error.to_string())?;
    let mut file = BufReader::new(file);
    expect_extended_records(&mut file, size)?;
    file.rewind().map_err(|error| error.to_string())?;
    let header = Header::new(&mut file).map_err(text)?;
    let record = u64::from(header.point_format().len());
    if header.point_format().is_compressed {
        let layout = header.laz_vlr().map_err(text)?;
        if layout.items_size() != record {
            return Err(format!(
                "points of {record} bytes expected, compressed as {} bytes",
                layout.items_size()
            ));
        }
        expect_chunks(&mut file, size, &layout)?;
    } else {
        expect_room(header.number_of_points(), record, size)?;
    }
    file.rewind().map_err(|error| error.to_string())?;
    let mut reader = Reader::new(file).map_err(text)?;
    let mut cloud = MapCloud::default();
    loop {
        let batch = reader.read_points(BATCH).map_err(text)?;
        if batch.is_empty() {
            return Ok(cloud);
        }
        for ((x, y), z) in batch.x().zip(batch.y()).zip(batch.z()) {
            cloud.add([x, y, z])?;
        }
    }
}

/// Compares the lengths of the records behind the points, which version 1.4 has, with the file.
fn expect_extended_records(file: &mut (impl Read + Seek), size: u64) -> Result<(), String> {
    let damaged = |_| "the header of a LAS file expected, it is cut off".to_owned();
    let mut header = [0; 247];
    // Older headers are shorter, and files with one may be.
    let mut limited = file.take(247);
    let mut filled = 0;
    while let Ok(count @ 1..) = limited.read(&mut header[filled..]) {
        filled += count;
    }
    let (major, minor) = (header[24], header[25]);
    if (major, minor) < (1, 4) {
        return Ok(());
    }
    let mut at = u64::from_le_bytes([0, 1, 2, 3, 4, 5, 6, 7].map(|i| header[235 + i]));
    let count = u32::from_le_bytes([0, 1, 2, 3].map(|i| header[243 + i]));
    for _ in 0..count {
        let mut record = [0; 60];
        file.seek(SeekFrom::Start(at)).map_err(damaged)?;
        file.read_exact(&mut record).map_err(damaged)?;
        let length = u64::from_le_bytes([0, 1, 2, 3, 4, 5, 6, 7].map(|i| record[20 + i]));
        let end = at
            .checked_add(60)
            .and_then(|start| start.checked_add(length));
        at = end.filter(|end| *end <= size).ok_or_else(|| {
            format!("a record of {length} bytes expected, but the file has only {size} bytes")
        })?;
    }
    Ok(())
}

/// Compares the lengths in compressed points with the file: that of the table of chunks, to which what
/// stands before the points leads, and those of the layers in which newer points are compressed. Each
/// chunk begins with a point that is not compressed.
fn expect_chunks(file: &mut (impl Read + Seek), size: u64, layout: &LazVlr) -> Result<(), String> {
    let damaged = |_| "compressed points expected, the file is cut off".to_owned();
    let first = file.stream_position().map_err(damaged)? + 8;
    let mut offset = [0; 8];
    file.read_exact(&mut offset).map_err(damaged)?;
    if i64::from_le_bytes(offset) < first as i64 {
        file.seek(SeekFrom::End(-8)).map_err(damaged)?;
        file.read_exact(&mut offset).map_err(damaged)?;
    }
    let table = u64::try_from(i64::from_le_bytes(offset)).ok();
    let table = table.filter(|table| *table >= first);
    if let Some(table) = table {
        let mut counts = [0; 8];
        file.seek(SeekFrom::Start(table)).map_err(damaged)?;
        file.read_exact(&mut counts).map_err(damaged)?;
        let chunks = u32::from_le_bytes([0, 1, 2, 3].map(|i| counts[4 + i]));
        if u64::from(chunks) > size / LEAST_RECORD {
            return Err(format!(
                "{chunks} chunks of points expected, but the file has only {size} bytes"
            ));
        }
    }
    let layers: u64 = layout.items().iter().map(layers_of).sum();
    if layers > 0 && table.is_none() {
        return Err("a table of the chunks of points expected, none found".to_owned());
    }
    let mut at = first;
    let table = table.filter(|_| layers > 0).unwrap_or(first);
    while at < table {
        // The first point, the number of points, and the lengths of all layers.
        let lengths_at = at + layout.items_size() + 4;
        file.seek(SeekFrom::Start(lengths_at)).map_err(damaged)?;
        let mut end = lengths_at + 4 * layers;
        for _ in 0..layers {
            let mut length = [0; 4];
            file.read_exact(&mut length).map_err(damaged)?;
            end += u64::from(u32::from_le_bytes(length));
        }
        if end > size {
            return Err(format!(
                "a chunk of points up to byte {end} expected, but the file has only {size} bytes"
            ));
        }
        at = end;
    }
    Ok(())
}

/// In how many layers a part of the points is compressed; none in older formats.
fn layers_of(item: &LazItem) -> u64 {
    match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGB14 | LazItemType::WavePacket14 => 1,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => u64::from(count),
        _ => 0,
    }
}
