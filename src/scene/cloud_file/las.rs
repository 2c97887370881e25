//! LAS and LAZ.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use std::thread;

use las::{Header, Reader};
use laz::{DecompressionSelection, LasZipDecompressor, LazItem, LazItemType, LazVlr};
use posescope_core::files;

use super::decoding::decoded;
use super::{Collector, MapCloud, expect_room};

/// Points per decoded batch.
const BATCH: u64 = 65_536;
/// The smallest size of an uncompressed point \[bytes\].
const MIN_RECORD: u64 = 20;

/// The stack of a decoder \[bytes\].
const STACK: usize = 32 << 20;
/// How much of it the decoder may have in use when it reads on \[bytes\].
const DEEPEST: usize = 1 << 20;

/// Reads the points. The decoder panics on damaged data, which becomes an error.
pub(super) fn read(path: &Path, size: u64) -> Result<MapCloud, String> {
    let decode = || decoded(|| points(path, size));
    thread::scope(|scope| {
        let decoder = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, decode);
        let read =
            decoder.map(thread::ScopedJoinHandle::join).map_err(|error| error.to_string())?;
        read.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn points(path: &Path, size: u64) -> Result<MapCloud, String> {
    let text = |error: las::Error| error.to_string();
    let file = files::open(path).map_err(|error| error.to_string())?;
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
        file.rewind().map_err(|error| error.to_string())?;
        return compressed(file, layout);
    }
    expect_room(header.number_of_points(), record, size)?;
    file.rewind().map_err(|error| error.to_string())?;
    let mut reader = Reader::new(file).map_err(text)?;
    let mut cloud = Collector::default();
    loop {
        let batch = reader.read_points(BATCH).map_err(text)?;
        if batch.is_empty() {
            return Ok(cloud.finish());
        }
        for ((x, y), z) in batch.x().zip(batch.y()).zip(batch.z()) {
            cloud.add([x, y, z])?;
        }
    }
}

/// Reads compressed points. Formats that keep what belongs to a point apart are decoded in part.
fn compressed(mut file: BufReader<File>, layout: LazVlr) -> Result<MapCloud, String> {
    let header = Header::new(&mut file).map_err(|error| error.to_string())?;
    let mut record = vec![0; layout.items_size() as usize];
    let coordinates = DecompressionSelection::xy_returns_channel().decompress_z();
    let mut points = LasZipDecompressor::selective(Shallow::new(file), layout, coordinates)
        .map_err(|error| error.to_string())?;
    let transforms = header.transforms();
    let mut cloud = Collector::default();
    for _ in 0..header.number_of_points() {
        points.decompress_one(&mut record).map_err(|error| error.to_string())?;
        let (numbers, _) = record.as_chunks();
        let at = |axis: usize| i32::from_le_bytes(numbers[axis]);
        cloud.add([
            transforms.x.direct(at(0)),
            transforms.y.direct(at(1)),
            transforms.z.direct(at(2)),
        ])?;
    }
    Ok(cloud.finish())
}

/// A file whose decoder may call itself only so often. That of a point's time does so for each switch to another
/// sequence of times, of which a sound file has one for a point and a damaged one has any number. It reads a byte for
/// 36,000 switches or fewer, so its stack is looked at whenever it reads.
struct Shallow {
    file: BufReader<File>,
    /// Where the stack is without the decoder.
    base: usize,
}

impl Shallow {
    fn new(file: BufReader<File>) -> Self {
        Self { file, base: stack() }
    }
}

impl Read for Shallow {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.base.abs_diff(stack()) > DEEPEST {
            return Err(io::Error::other("times of points expected, the file is damaged"));
        }
        self.file.read(bytes)
    }
}

impl Seek for Shallow {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// About where the stack of this thread ends.
fn stack() -> usize {
    let here = 0_u8;
    std::ptr::from_ref(&here).addr()
}

/// Bytes at a position of a file.
fn bytes_at<const N: usize>(file: &mut (impl Read + Seek), at: u64) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    let read = file.seek(SeekFrom::Start(at));
    read.and_then(|_| file.read_exact(&mut bytes))
        .map_err(|_| "a complete LAS file expected, it is cut off".to_owned())?;
    Ok(bytes)
}

/// Checks the lengths of the records after the points (version 1.4) against the size of the file.
fn expect_extended_records(file: &mut (impl Read + Seek), size: u64) -> Result<(), String> {
    let version: [u8; 2] = bytes_at(file, 24)?;
    if version < [1, 4] {
        return Ok(());
    }
    let mut at = u64::from_le_bytes(bytes_at(file, 235)?);
    let count = u32::from_le_bytes(bytes_at(file, 243)?);
    for _ in 0..count {
        let length = u64::from_le_bytes(bytes_at(file, at.saturating_add(20))?);
        at = at.saturating_add(60).saturating_add(length);
        if at > size {
            return Err(format!(
                "a record of {length} bytes expected, but the file has only {size} bytes"
            ));
        }
    }
    Ok(())
}

/// Checks the lengths inside compressed points against the size of the file: that of the chunk table, whose position
/// precedes the points, and those of the layers that newer point formats are compressed in. Each chunk begins with
/// an uncompressed point.
fn expect_chunks(file: &mut (impl Read + Seek), size: u64, layout: &LazVlr) -> Result<(), String> {
    let damaged = |_| "compressed points expected, the file is cut off".to_owned();
    let start = file.stream_position().map_err(damaged)?;
    let first = start + 8;
    let mut table = i64::from_le_bytes(bytes_at(file, start)?);
    if table < first as i64 {
        table = i64::from_le_bytes(bytes_at(file, size.saturating_sub(8))?);
    }
    let table = u64::try_from(table).ok().filter(|table| *table >= first);
    if let Some(table) = table {
        let chunks = u32::from_le_bytes(bytes_at(file, table.saturating_add(4))?);
        if u64::from(chunks) > size / MIN_RECORD {
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
    let mut lengths = vec![0; 4 * layers as usize];
    let table = table.filter(|_| layers > 0).unwrap_or(first);
    while at < table {
        // The first point, the number of points, and the lengths of all layers.
        let lengths_at = at + layout.items_size() + 4;
        file.seek(SeekFrom::Start(lengths_at)).map_err(damaged)?;
        file.read_exact(&mut lengths).map_err(damaged)?;
        let (numbers, _) = lengths.as_chunks();
        let length: u64 = numbers.iter().map(|number| u64::from(u32::from_le_bytes(*number))).sum();
        let end = lengths_at + 4 * layers + length;
        if end > size {
            return Err(format!(
                "a chunk of points up to byte {end} expected, but the file has only {size} bytes"
            ));
        }
        at = end;
    }
    Ok(())
}

/// The number of layers that an item is compressed in; 0 in older formats.
fn layers_of(item: &LazItem) -> u64 {
    match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGB14 | LazItemType::WavePacket14 => 1,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => u64::from(count),
        _ => 0,
    }
}
