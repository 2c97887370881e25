//! Errors of the graphics card as values.

use eframe::wgpu;

/// Runs something whose errors are wanted as values instead of a panic.
pub(super) fn guarded<T>(device: &wgpu::Device, run: impl FnOnce() -> T) -> Result<T, String> {
    let scopes = [
        wgpu::ErrorFilter::Internal,
        wgpu::ErrorFilter::OutOfMemory,
        wgpu::ErrorFilter::Validation,
    ]
    .map(|filter| device.push_error_scope(filter));
    let value = run();
    let mut error = None;
    for scope in scopes.into_iter().rev() {
        error = error.or(at_once(scope.pop()).flatten());
    }
    match error {
        Some(error) => Err(one_line(&error.to_string())),
        None => Ok(value),
    }
}

/// The value of a future that is ready, as those of the error scopes are outside of browsers.
pub(super) fn at_once<T>(future: impl Future<Output = T>) -> Option<T> {
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    match std::pin::pin!(future).poll(&mut context) {
        std::task::Poll::Ready(value) => Some(value),
        std::task::Poll::Pending => None,
    }
}

/// An error of wgpu in one line: what caused it, without the headings.
pub(super) fn one_line(text: &str) -> String {
    let causes = text
        .split_once("Caused by:")
        .map_or(text, |(_, causes)| causes);
    let lines: Vec<_> = causes
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    lines.join(": ")
}
