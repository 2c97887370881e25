//! Drivers print on standard error what concerns nobody, such as that XDG_RUNTIME_DIR is missing on a machine without
//! a display.

#[cfg(unix)]
use std::fs::File;
#[cfg(unix)]
use std::os::fd::OwnedFd;
#[cfg(unix)]
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Does the work. Meanwhile nothing reaches standard error, where the system can do that.
pub(crate) fn quietly<T>(work: impl FnOnce() -> T) -> T {
    #[cfg(unix)]
    let _until_here = Silence::begin();
    work()
}

/// Standard error as it was, until the end of the silence.
#[cfg(unix)]
struct Silence {
    stderr: OwnedFd,
    /// Two at a time would each restore what the other had set.
    _only: MutexGuard<'static, ()>,
}

#[cfg(unix)]
impl Silence {
    /// Without a copy of standard error, or without a device that takes everything, there is none.
    fn begin() -> Option<Self> {
        static ONLY: Mutex<()> = Mutex::new(());
        let _only = ONLY.lock().unwrap_or_else(PoisonError::into_inner);
        let stderr = rustix::stdio::stderr().try_clone_to_owned().ok()?;
        let nowhere = File::options().write(true).open("/dev/null").ok()?;
        rustix::stdio::dup2_stderr(&nowhere).ok()?;
        Some(Self { stderr, _only })
    }
}

#[cfg(unix)]
impl Drop for Silence {
    fn drop(&mut self) {
        rustix::stdio::dup2_stderr(&self.stderr).ok();
    }
}
