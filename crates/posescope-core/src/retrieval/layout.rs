//! The file of an index: numbers in little-endian order, written from front to back.
//!
//! | part | one record | |
//! |---|---|---|
//! | magic | 8 bytes | the last one is the number of the layout |
//! | features | word, x, y, scale, angle | by document, then by word |
//! | documents | frame, first feature | and one more, whose first feature ends the last document |
//! | words | 64 numbers | the centres of the vocabulary |
//! | lists | first posting, idf | by word, and one more |
//! | postings | document, weight | the inverted index |
//! | description | JSON | scene, recipe, numbers of records |
//! | footer | length of the description, checksum | XXH3 of all before the checksum |

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek as _, Write};
use std::ops::Range;
use std::path::Path;

use memmap2::Mmap;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use super::error::IndexError;
use crate::features::{Descriptor, Keypoint};

/// Raised with every change of the layout.
const LAYOUT: u8 = 1;
const KIND: [u8; 7] = *b"PSINDEX";
const MAGIC: usize = 8;
const FOOTER: usize = 16;
const FEATURE: usize = 20;
const DOCUMENT: usize = 8;
const WORD: usize = size_of::<Descriptor>();
const LIST: usize = 8;
const POSTING: usize = 8;
/// Bytes read at a time to check them.
const BLOCK: usize = 1 << 20;

/// What an index was made from and how.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Description {
    /// The scene's name.
    pub scene: String,
    /// Changes with the scene's frames; in hexadecimal.
    pub fingerprint: String,
    /// Everything that decides what the index holds, by name.
    pub recipe: BTreeMap<String, String>,
    /// Trees of the forest.
    pub trees: usize,
    /// The seed of the forest.
    pub seed: u64,
    /// Numbers of records.
    pub counts: RecordCounts,
}

/// Numbers of records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordCounts {
    /// Features of all documents.
    pub features: usize,
    /// Documents.
    pub documents: usize,
    /// Words.
    pub words: usize,
    /// Postings.
    pub postings: usize,
}

/// A feature of an indexed frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexedFeature {
    /// The visual word of the feature.
    pub word: u32,
    /// The column of its keypoint \[px\].
    pub x: f32,
    /// The row of its keypoint \[px\].
    pub y: f32,
    /// See [`Keypoint::scale`].
    pub scale: f32,
    /// See [`Keypoint::angle`].
    pub angle: f32,
}

impl IndexedFeature {
    /// What is known of the feature.
    pub fn keypoint(&self) -> Keypoint {
        Keypoint {
            x: self.x,
            y: self.y,
            scale: self.scale,
            angle: self.angle,
            response: 0.0,
            laplacian_positive: false,
        }
    }
}

/// Writes an index from front to back and sums it up.
pub struct IndexWriter<W> {
    out: W,
    sum: Xxh3,
}

impl<W: Write> IndexWriter<W> {
    /// Begins with the magic.
    pub fn new(out: W) -> io::Result<Self> {
        let mut writer = Self { out, sum: Xxh3::new() };
        writer.bytes(&KIND)?;
        writer.bytes(&[LAYOUT])?;
        Ok(writer)
    }

    fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sum.update(bytes);
        self.out.write_all(bytes)
    }

    /// A record of two numbers.
    pub fn pair(&mut self, first: u32, second: [u8; 4]) -> io::Result<()> {
        let mut record = [0; 8];
        record[..4].copy_from_slice(&first.to_le_bytes());
        record[4..].copy_from_slice(&second);
        self.bytes(&record)
    }

    /// Writes a feature.
    pub fn feature(&mut self, feature: &IndexedFeature) -> io::Result<()> {
        let IndexedFeature { word, x, y, scale, angle } = *feature;
        self.bytes(&word.to_le_bytes())?;
        [x, y, scale, angle].iter().try_for_each(|number| self.bytes(&number.to_le_bytes()))
    }

    /// Writes a visual word.
    pub fn word(&mut self, word: &Descriptor) -> io::Result<()> {
        word.iter().try_for_each(|number| self.bytes(&number.to_le_bytes()))
    }

    /// Ends with the description and the footer.
    pub fn finish(mut self, description: &Description) -> io::Result<()> {
        let text = serde_json::to_vec(description)?;
        self.bytes(&text)?;
        self.bytes(&(text.len() as u64).to_le_bytes())?;
        let sum = self.sum.digest();
        self.out.write_all(&sum.to_le_bytes())?;
        self.out.flush()
    }
}

/// An index in its file, mapped: only the parts in use come into memory.
pub struct MappedIndex {
    map: Mmap,
    description: Description,
    features: Range<usize>,
    documents: Range<usize>,
    words: Range<usize>,
    lists: Range<usize>,
    postings: Range<usize>,
}

impl MappedIndex {
    /// Maps a file whose every byte was checked before.
    pub fn open(path: &Path) -> Result<Self, IndexError> {
        let io = |source: io::Error| match source.kind() {
            io::ErrorKind::NotFound => IndexError::NotFound { path: path.to_owned() },
            _ => IndexError::Io { path: path.to_owned(), source },
        };
        let damaged = |what| IndexError::Damaged { path: path.to_owned(), what };
        let mut file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let length = usize::try_from(length).map_err(|_| damaged("it is too long"))?;
        let mut magic = [0; MAGIC];
        let read = file.read_exact(&mut magic);
        if read.is_err() || magic[..KIND.len()] != KIND {
            return Err(IndexError::NotAnIndex { path: path.to_owned() });
        }
        if length < MAGIC + FOOTER {
            return Err(damaged("it is cut off"));
        }
        file.rewind().map_err(io)?;
        let summed = length - size_of::<u64>();
        let sum = checksum(&mut file, summed).map_err(io)?;
        let map = map(&file).map_err(io)?;
        let footer = map.get(summed - size_of::<u64>()..length);
        let Some([text_length, expected]) = footer.and_then(|footer| {
            let (numbers, _) = footer.as_chunks::<8>();
            numbers.first_chunk::<2>()
        }) else {
            return Err(damaged("it is cut off"));
        };
        if u64::from_le_bytes(*expected) != sum {
            return Err(damaged("its checksum does not match"));
        }
        if magic[KIND.len()] != LAYOUT {
            return Err(IndexError::Version {
                path: path.to_owned(),
                found: magic[KIND.len()],
                expected: LAYOUT,
            });
        }
        let text_length = u64::from_le_bytes(*text_length);
        Self::parse(map, text_length).ok_or_else(|| damaged("its parts do not fit together"))
    }

    /// Whatever the file says, every range that is used later lies within it.
    fn parse(map: Mmap, text_length: u64) -> Option<Self> {
        let text_end = map.len().checked_sub(FOOTER)?;
        let text_start = text_end.checked_sub(usize::try_from(text_length).ok()?)?;
        let description: Description =
            serde_json::from_slice(map.get(text_start..text_end)?).ok()?;
        let counts = description.counts;
        let mut at = MAGIC;
        let mut part = |records: usize, size: usize| {
            let start = at;
            at = at.checked_add(records.checked_mul(size)?)?;
            Some(start..at)
        };
        let stored = Self {
            features: part(counts.features, FEATURE)?,
            documents: part(counts.documents.checked_add(1)?, DOCUMENT)?,
            words: part(counts.words, WORD)?,
            lists: part(counts.words.checked_add(1)?, LIST)?,
            postings: part(counts.postings, POSTING)?,
            map,
            description,
        };
        if stored.postings.end != text_start {
            return None;
        }
        let rises = |starts: &mut dyn Iterator<Item = usize>, end: usize| {
            let mut last = Some(0);
            for start in starts {
                last = last.filter(|last| *last <= start).map(|_| start);
            }
            last == Some(end)
        };
        let document = |document| stored.pair(&stored.documents, document);
        let list = |word| stored.pair(&stored.lists, word);
        let documents = &mut (0..=counts.documents).filter_map(document);
        let lists = &mut (0..=counts.words).filter_map(list);
        let is_sound = rises(&mut documents.map(|(_, start)| start as usize), counts.features)
            && rises(&mut lists.map(|(start, _)| start as usize), counts.postings);
        is_sound.then_some(stored)
    }

    /// What the index was made from and how.
    pub fn description(&self) -> &Description {
        &self.description
    }

    fn records<const SIZE: usize>(&self, part: &Range<usize>) -> &[[u8; SIZE]] {
        let bytes = self.map.get(part.clone()).unwrap_or_default();
        bytes.as_chunks().0
    }

    fn pair(&self, part: &Range<usize>, index: usize) -> Option<(u32, u32)> {
        self.records::<8>(part).get(index).map(numbers)
    }

    /// The position of a document's frame in its scene.
    pub fn frame(&self, document: usize) -> Option<usize> {
        self.pair(&self.documents, document).map(|(frame, _)| frame as usize)
    }

    /// The features of a document, in the order of their words.
    pub fn features(&self, document: usize) -> impl ExactSizeIterator<Item = IndexedFeature> {
        let start = |document| self.pair(&self.documents, document).map(|pair| pair.1);
        let range = start(document).zip(start(document + 1));
        let range = range.map_or(0..0, |(start, end)| start as usize..end as usize);
        let records = self.records::<FEATURE>(&self.features);
        records.get(range).unwrap_or_default().iter().map(|record| {
            let (fields, _) = record.as_chunks::<4>();
            let number = |field: usize| f32::from_le_bytes(fields[field]);
            IndexedFeature {
                word: u32::from_le_bytes(fields[0]),
                x: number(1),
                y: number(2),
                scale: number(3),
                angle: number(4),
            }
        })
    }

    /// The centres of the vocabulary.
    pub fn words(&self) -> Vec<Descriptor> {
        self.records::<WORD>(&self.words)
            .iter()
            .map(|record| {
                let (numbers, _) = record.as_chunks::<4>();
                std::array::from_fn(|i| f32::from_le_bytes(numbers[i]))
            })
            .collect()
    }

    /// The inverse document frequency of a word.
    pub fn idf(&self, word: u32) -> f32 {
        let list = self.pair(&self.lists, word as usize);
        list.map_or(0.0, |(_, idf)| f32::from_bits(idf))
    }

    /// The documents with a word, and its weight there.
    pub fn postings(&self, word: u32) -> impl Iterator<Item = (usize, f32)> {
        let start = |word| self.pair(&self.lists, word).map(|pair| pair.0 as usize);
        let range = start(word as usize).zip(start(word as usize + 1));
        let range = range.map_or(0..0, |(start, end)| start..end);
        let records = self.records::<POSTING>(&self.postings);
        records.get(range).unwrap_or_default().iter().map(|record| {
            let (document, weight) = numbers(record);
            (document as usize, f32::from_bits(weight))
        })
    }
}

fn numbers(record: &[u8; 8]) -> (u32, u32) {
    let [a, b, c, d, e, f, g, h] = *record;
    (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]))
}

/// The checksum of the next `length` bytes. Read and not mapped, so that checking a large index
/// does not bring all of it into the memory of the process.
fn checksum(file: &mut File, length: usize) -> io::Result<u64> {
    let mut sum = Xxh3::new();
    let mut block = vec![0; BLOCK.min(length)];
    let mut left = length;
    while left > 0 {
        let block = &mut block[..left.min(BLOCK)];
        file.read_exact(block)?;
        sum.update(block);
        left -= block.len();
    }
    Ok(sum.digest())
}

/// The file as bytes. The one unsafe line of the crate: there is no other way to map a file.
#[allow(
    unsafe_code,
    reason = "sound as long as nobody changes the file: an index is written under another name and \
              then renamed, never changed in place, and a mapping keeps the file it was made from"
)]
fn map(file: &File) -> io::Result<Mmap> {
    // SAFETY: the mapping is read-only and private, and see above.
    unsafe { Mmap::map(file) }
}
