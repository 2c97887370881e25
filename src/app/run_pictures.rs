//! The pictures of a run that are made beside the window's thread: a small one for each stage, a proof for each result.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;

use super::proofs::Proofs;
use super::thumbnails::Thumbnails;
use crate::params::Params;
use crate::proof::ProofPicture;
use crate::session::{Part, Run};

/// The pictures of one run.
pub(super) struct RunPictures {
    thumbnails: RefCell<Thumbnails>,
    proofs: Proofs,
}

impl RunPictures {
    pub(super) fn new(ctx: &egui::Context) -> Self {
        Self {
            thumbnails: RefCell::new(Thumbnails::new(ctx.clone())),
            proofs: Proofs::new(ctx.clone()),
        }
    }

    /// Takes in what is ready, and asks for the proofs of new results.
    pub(super) fn update(&mut self, run: &Run, params: &Arc<Params>, shows_truth: bool) {
        self.thumbnails.get_mut().poll();
        self.proofs.update(run, params, shows_truth);
    }

    /// Drops everything: the run is another one.
    pub(super) fn forget(&mut self) {
        self.thumbnails.get_mut().forget();
        self.proofs.forget();
    }

    /// The small picture of a stage, once it is made; asking for it has it made.
    pub(super) fn thumbnail(
        &self,
        run: &Run,
        part: &Range<usize>,
        stage: &Range<usize>,
    ) -> Option<egui::TextureHandle> {
        let mut thumbnails = self.thumbnails.borrow_mut();
        thumbnails.of(run, part.clone(), stage.clone())
    }

    /// The proof of a part's result, once it is made.
    pub(super) fn proof(&self, part: Part) -> Option<&Arc<ProofPicture>> {
        self.proofs.of(part)
    }

    /// Whether proofs are being made.
    pub(super) fn is_proving(&self) -> bool {
        self.proofs.is_busy()
    }

    /// Whether any picture is being made.
    pub(super) fn is_busy(&self) -> bool {
        self.proofs.is_busy() || self.thumbnails.borrow().is_busy()
    }
}
