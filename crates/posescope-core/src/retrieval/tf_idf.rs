//! Weights of words: term frequency times inverse document frequency, compared by the cosine.
//!
//! Philbin et al. 2007, section 3 (after Sivic, Zisserman, *Video Google*, ICCV 2003): with `n_wd`
//! of the `n_d` features of image d on word w, and the word in `N_w` of `N` images, its weight is
//! `n_wd / n_d · ln(N / N_w)`. A word that every image has weighs nothing. Images are compared by the
//! cosine of their weights, in which `n_d` cancels out.

/// The inverted index while it grows: which documents have a word, and how often.
pub struct InvertedIndexBuilder {
    /// By word: document and count, in the order of the documents.
    lists: Vec<Vec<(u32, u32)>>,
    documents: u32,
}

/// The inverted index: which documents have a word, and how much it weighs there.
pub struct InvertedIndex {
    /// By word, `ln(N / N_w)`; 0 for a word in no document.
    pub idf: Vec<f32>,
    /// By word: document and its weight, over the norm of all weights of the document.
    pub lists: Vec<Vec<(u32, f32)>>,
}

impl InvertedIndexBuilder {
    /// An index without a document yet.
    pub fn new(words: usize) -> Self {
        Self { lists: vec![Vec::new(); words], documents: 0 }
    }

    /// The next document, by its words in ascending order.
    pub fn push(&mut self, words: &[u32]) {
        for run in words.chunk_by(|a, b| a == b) {
            self.lists[run[0] as usize].push((self.documents, run.len() as u32));
        }
        self.documents += 1;
    }

    /// The weights. Words of no weight have an empty list.
    pub fn weighted(self) -> InvertedIndex {
        let documents = f64::from(self.documents);
        let idf: Vec<f64> = self
            .lists
            .iter()
            .map(|list| match list.len() {
                0 => 0.0,
                with => (documents / with as f64).ln(),
            })
            .collect();
        let mut squares = vec![0.0; self.documents as usize];
        for (list, idf) in self.lists.iter().zip(&idf) {
            for &(document, count) in list {
                squares[document as usize] += (f64::from(count) * idf).powi(2);
            }
        }
        let weighted = |(list, idf): (Vec<(u32, u32)>, &f64)| {
            if *idf == 0.0 {
                return Vec::new();
            }
            let weight = |(document, count): (u32, u32)| {
                let norm = squares[document as usize].sqrt();
                (document, (f64::from(count) * idf / norm) as f32)
            };
            list.into_iter().map(weight).collect()
        };
        InvertedIndex {
            lists: self.lists.into_iter().zip(&idf).map(weighted).collect(),
            idf: idf.iter().map(|&idf| idf as f32).collect(),
        }
    }
}

/// The weights of a query by its words in ascending order, with unit norm: word and weight. Empty
/// where no word weighs anything.
pub fn query_weights(words: &[u32], idf: impl Fn(u32) -> f32) -> Vec<(u32, f32)> {
    let mut weights: Vec<(u32, f32)> = words
        .chunk_by(|a, b| a == b)
        .map(|run| (run[0], run.len() as f32 * idf(run[0])))
        .filter(|(_, weight)| *weight > 0.0)
        .collect();
    let norm = weights.iter().map(|(_, w)| w * w).sum::<f32>().sqrt();
    for (_, weight) in &mut weights {
        *weight /= norm;
    }
    weights
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn inverted(documents: &[&[u32]], words: usize) -> InvertedIndex {
        let mut occurrences = InvertedIndexBuilder::new(words);
        for document in documents {
            occurrences.push(document);
        }
        occurrences.weighted()
    }

    fn score(index: &InvertedIndex, query: &[u32], document: u32) -> f32 {
        query_weights(query, |word| index.idf[word as usize])
            .iter()
            .flat_map(|&(word, weight)| {
                let list = &index.lists[word as usize];
                list.iter().map(move |&(d, w)| (d, w * weight))
            })
            .filter(|(d, _)| *d == document)
            .map(|(_, product)| product)
            .sum()
    }

    #[test]
    fn three_documents_by_hand() {
        // Words a = 0 … d = 3, e = 4 in none: {a, a, b}, {a, b, c}, {a, d}.
        let index = inverted(&[&[0, 0, 1], &[0, 1, 2], &[0, 3]], 5);
        // ln 3/3, ln 3/2, ln 3/1, ln 3/1.
        let expected = [0.0, 0.405_465_1, 1.098_612_3, 1.098_612_3, 0.0];
        for (idf, expected) in index.idf.iter().zip(expected) {
            assert!((idf - expected).abs() < 1e-6, "{idf} {expected}");
        }
        // a weighs nothing, so that the first document is b alone and the last is d alone; the
        // second is (0.4055, 1.0986) over its norm 1.1710.
        assert!(index.lists[0].is_empty() && index.lists[4].is_empty());
        let close = |list: &[(u32, f32)], expected: &[(u32, f32)]| {
            assert_eq!(list.len(), expected.len());
            for (found, expected) in list.iter().zip(expected) {
                assert_eq!(found.0, expected.0);
                assert!((found.1 - expected.1).abs() < 1e-4, "{found:?} {expected:?}");
            }
        };
        close(&index.lists[1], &[(0, 1.0), (1, 0.3462)]);
        close(&index.lists[2], &[(1, 0.9381)]);
        close(&index.lists[3], &[(2, 1.0)]);
        // The query {b, b, d}: (0.8109, 1.0986) over 1.3655.
        assert!((score(&index, &[1, 1, 3], 0) - 0.5939).abs() < 1e-4);
        assert!((score(&index, &[1, 1, 3], 1) - 0.5939 * 0.3462).abs() < 1e-4);
        assert!((score(&index, &[1, 1, 3], 2) - 0.8046).abs() < 1e-4);
        // Nothing but words without weight.
        assert!(query_weights(&[0, 0, 4], |word| index.idf[word as usize]).is_empty());
    }

    proptest! {
        #[test]
        fn a_document_resembles_itself_most(
            mut documents in prop::collection::vec(prop::collection::vec(0u32..30, 1..40), 2..12),
        ) {
            for document in &mut documents {
                document.sort_unstable();
            }
            let slices: Vec<&[u32]> = documents.iter().map(Vec::as_slice).collect();
            let index = inverted(&slices, 30);
            for (number, document) in documents.iter().enumerate() {
                let own = score(&index, document, number as u32);
                let weightless = document.iter().all(|&word| index.idf[word as usize] == 0.0);
                prop_assert!(weightless || (own - 1.0).abs() < 1e-5, "{}", own);
                for other in 0..documents.len() as u32 {
                    let score = score(&index, document, other);
                    prop_assert!((0.0..=own + 1e-5).contains(&score));
                }
            }
        }
    }
}
