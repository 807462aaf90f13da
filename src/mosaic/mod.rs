//! Putting the two photos together (paper, section 3.2.4).

mod blend;
mod canvas;
mod fill;

pub use blend::{Mosaic, blend};
pub use fill::{FillOptions, fill};

pub(crate) use canvas::check_canvas;
