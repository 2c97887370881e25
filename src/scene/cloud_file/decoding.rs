//! Decoders of other crates that panic on damaged data.

use std::cell::Cell;
use std::panic::{UnwindSafe, catch_unwind};

thread_local! {
    static IS_DECODING: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread is a decoder's, which is caught and says nothing but that a file is damaged.
pub fn is_decoding() -> bool {
    IS_DECODING.get()
}

/// Decodes a file. A panic becomes an error.
pub(super) fn decoded<T>(
    decode: impl FnOnce() -> Result<T, String> + UnwindSafe,
) -> Result<T, String> {
    IS_DECODING.set(true);
    let read = catch_unwind(decode);
    IS_DECODING.set(false);
    read.unwrap_or_else(|_| Err("decodable points expected; the file is damaged".to_owned()))
}
