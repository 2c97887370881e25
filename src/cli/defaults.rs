//! The defaults of the program.

/// The scene of the demonstration.
pub const SCENE: &str = "street";
/// Its query: parked cars hide part of what the reference saw.
pub const QUERY: &str = "000070";
/// Its reference.
pub const REFERENCE: &str = "000062";
/// Where recordings and pictures go by default.
pub const FOLDER: &str = "recordings";
