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
use crate::files;

/// Raised with every change of the layout.
const LAYOUT: u8 = 1;
const KIND: [u8; 7] = *b"PSINDEX";
const MAGIC: usize = 8;
const FOOTER: usize = 16;
/// Numbers of a record, each of 32 bits.
const FEATURE: usize = 5;
const PAIR: usize = 2;
const WORD: usize = 64;
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

    /// Writes a record.
    pub fn record(&mut self, numbers: impl IntoIterator<Item = u32>) -> io::Result<()> {
        numbers.into_iter().try_for_each(|number| self.bytes(&number.to_le_bytes()))
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
    /// What the index was made from and how.
    pub description: Description,
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
        let mut file = files::open(path).map_err(io)?;
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
        let mut part = |records: usize, numbers: usize| {
            let start = at;
            at = at.checked_add(records.checked_mul(numbers * size_of::<u32>())?)?;
            Some(start..at)
        };
        let stored = Self {
            features: part(counts.features, FEATURE)?,
            documents: part(counts.documents.checked_add(1)?, PAIR)?,
            words: part(counts.words, WORD)?,
            lists: part(counts.words.checked_add(1)?, PAIR)?,
            postings: part(counts.postings, PAIR)?,
            map,
            description,
        };
        if stored.postings.end != text_start {
            return None;
        }
        let rises = |part: &Range<usize>, place: usize, end: usize| {
            let records = stored.records::<PAIR>(part).iter();
            let mut starts = records.map(|record| u32::from_le_bytes(record[place]) as usize);
            starts.clone().is_sorted() && starts.next_back() == Some(end)
        };
        let is_sound = rises(&stored.documents, 1, counts.features)
            && rises(&stored.lists, 0, counts.postings);
        is_sound.then_some(stored)
    }

    /// The records of a part, of `N` numbers each.
    fn records<const N: usize>(&self, part: &Range<usize>) -> &[[[u8; 4]; N]] {
        let bytes = self.map.get(part.clone()).unwrap_or_default();
        bytes.as_chunks::<4>().0.as_chunks().0
    }

    fn pair(&self, part: &Range<usize>, index: usize) -> Option<[u32; PAIR]> {
        Some(self.records::<PAIR>(part).get(index)?.map(u32::from_le_bytes))
    }

    /// The records of a part from a start to the next one; `starts` are at this place of the pairs of another
    /// part. None where there is no such start.
    fn run<const N: usize>(
        &self,
        part: &Range<usize>,
        (starts, place): (&Range<usize>, usize),
        index: usize,
    ) -> impl ExactSizeIterator<Item = [u32; N]> {
        let start = |index| self.pair(starts, index).map_or(0, |pair| pair[place] as usize);
        let records = self.records::<N>(part).get(start(index)..start(index + 1));
        records.unwrap_or_default().iter().map(|record| record.map(u32::from_le_bytes))
    }

    /// The position of a document's frame in its scene.
    pub fn frame(&self, document: usize) -> Option<usize> {
        self.pair(&self.documents, document).map(|[frame, _]| frame as usize)
    }

    /// The features of a document, each with its visual word, in the order of their words.
    pub fn features(&self, document: usize) -> impl ExactSizeIterator<Item = (u32, Keypoint)> {
        self.run::<FEATURE>(&self.features, (&self.documents, 1), document).map(
            |[word, place @ ..]| {
                let [x, y, scale, angle] = place.map(f32::from_bits);
                let (response, laplacian_positive) = (0.0, false);
                (word, Keypoint { x, y, scale, angle, response, laplacian_positive })
            },
        )
    }

    /// The centres of the vocabulary.
    pub fn words(&self) -> Vec<Descriptor> {
        let words = self.records::<WORD>(&self.words).iter();
        words.map(|numbers| numbers.map(f32::from_le_bytes)).collect()
    }

    /// The inverse document frequency of a word.
    pub fn idf(&self, word: u32) -> f32 {
        let list = self.pair(&self.lists, word as usize);
        list.map_or(0.0, |[_, idf]| f32::from_bits(idf))
    }

    /// The documents with a word, and its weight there.
    pub fn postings(&self, word: u32) -> impl Iterator<Item = (usize, f32)> {
        let postings = self.run::<PAIR>(&self.postings, (&self.lists, 0), word as usize);
        postings.map(|[document, weight]| (document as usize, f32::from_bits(weight)))
    }
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
