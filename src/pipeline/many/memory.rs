//! How much memory many photos take: as the two largest alone, and what is held of all.

use super::graph;
use super::reduced::reduced_sizes;
use crate::Result;
use crate::geometry::{Distortion, Undistortion};
use crate::pipeline::memory::{FEATURE, Job, MAP, MASK, MASKED, Memory, RGBA, pixels, refuse_above};
use crate::pipeline::options::Options;
use crate::pipeline::picture::Size;

/// Bytes per pixel that are held of every photo that is aligned: the map through its landmarks and what stereo found.
const ALIGNED: u64 = 2 * MAP;
/// Features of a photo.
const FEATURES: u64 = graph::FEATURES as u64 * FEATURE;
/// Tracks of a photo, its landmarks, and their part of the equations of bundle adjustment.
const GEOMETRY: u64 = 600_000;
/// Per pixel of the canvas, besides what two photos take: the composition with its labels, footprint and depth.
const CANVAS: u64 = RGBA + 2 * MASK + MAP;

/// What will be taken, and what may be.
#[derive(Clone)]
pub(crate) struct Budget<'a> {
    memory: Memory<'a>,
    pub(super) options: &'a Options,
    /// How often photos are halved before they are aligned.
    pub(super) halvings: u32,
    /// Sizes of the photos given.
    pub(super) given: Vec<Size>,
    largest: Size,
    /// Bytes held all along.
    held: u64,
    /// Bytes held of the photos that are worked on.
    working: u64,
    /// Bytes of results that are only made when the picture is there.
    results: u64,
    limit: u64,
}

impl<'a> Budget<'a> {
    /// Of photos of these sizes (width, height), which are halved so often before they are aligned.
    pub fn of(sizes: &[Size], halvings: u32, options: &'a Options) -> Self {
        let aligned = reduced_sizes(sizes, halvings);
        let (memory, largest) = of_largest(&aligned, options);
        let held = total(sizes).saturating_mul(RGBA).saturating_add((FEATURES + GEOMETRY) * sizes.len() as u64);
        let copies = if halvings > 0 { RGBA } else { 0 };
        let working = total(&aligned).saturating_mul(ALIGNED + copies);
        let given = sizes.to_vec();
        Self { memory, options, halvings, given, largest, held, working, results: 0, limit: options.warp.max_bytes }
    }

    /// Of what is held of a masked photo: a copy, and distances.
    pub fn add_masked(&mut self, size: Size) {
        self.held = self.held.saturating_add(pixels(size).saturating_mul(RGBA + MASKED));
    }

    /// Of a depth map that is given, and of a copy that is aligned instead.
    pub fn add_depth(&mut self, size: Size) {
        let copy = if self.halvings > 0 { total(&reduced_sizes(&[size], self.halvings)) } else { 0 };
        self.held = self.held.saturating_add(pixels(size).saturating_add(copy).saturating_mul(MAP));
    }

    /// Copies of the photos, and their depth, in frames of these sizes are held beside those given, and are what is worked on.
    ///
    /// # Errors
    /// `too-large`.
    pub fn undistort(&mut self, frames: &[Size]) -> Result<()> {
        (self.memory, self.largest) = of_largest(frames, self.options);
        self.working = self.working.saturating_add(total(frames).saturating_mul(RGBA + MASKED + MAP));
        self.check((0, 0))
    }

    /// Refuses photos that would take more than is allowed without this distortion.
    ///
    /// # Errors
    /// `too-large`.
    pub fn check_undistorted(&self, distortion: Distortion) -> Result<()> {
        let frame = |size| Undistortion::of(size, distortion).frame;
        self.clone().undistort(&reduced_sizes(&self.given, self.halvings).into_iter().map(frame).collect::<Vec<_>>())
    }

    /// Of photos that are aligned, and drawn after so many halvings: in `frames` of these sizes without distortion.
    pub fn drawing(&self, halvings: u32, frames: &[Size]) -> Self {
        let mut own = self.clone();
        if self.options.output_depth && self.halvings.max(halvings) > 0 {
            // Without distortion the photo as well.
            own.results = total(&self.given).saturating_mul(RGBA + MAP);
        }
        if halvings != self.halvings {
            // Of what was aligned only depth is left.
            let reduced = |halvings: u32| total(&reduced_sizes(&self.given, halvings));
            let copies = if halvings > 0 { reduced(halvings).saturating_mul(RGBA + MAP) } else { 0 };
            own.working = reduced(self.halvings).saturating_mul(MAP).saturating_add(copies);
            let (memory, largest) = of_largest(frames, self.options);
            (own.memory, own.largest) = (memory.drawing(), largest);
        }
        own
    }

    /// How many times over all of it may be taken, before the canvas is known.
    #[cfg(all(target_arch = "wasm32", feature = "wasm-many"))]
    pub fn times(&self) -> u64 {
        self.limit / self.bytes((0, 0)).max(1)
    }

    /// What is predicted with this canvas.
    fn bytes(&self, canvas: Size) -> u64 {
        let held = self.held.saturating_add(self.working).saturating_add(pixels(canvas).saturating_mul(CANVAS));
        self.memory.peak(canvas).1.max(self.results).saturating_add(held)
    }

    /// Refuses what would take more than is allowed with this canvas.
    ///
    /// # Errors
    /// `too-large`.
    pub fn check(&self, canvas: Size) -> Result<()> {
        refuse_above(self.limit, self.bytes(canvas), if canvas.0 > 0 { canvas } else { self.largest })
    }
}

fn total(sizes: &[Size]) -> u64 {
    sizes.iter().map(|&size| pixels(size)).fold(0, u64::saturating_add)
}

/// What the two largest photos take alone, and the size of the first.
fn of_largest<'a>(sizes: &[Size], options: &'a Options) -> (Memory<'a>, Size) {
    let (mut first, mut second) = ((0, 0), (0, 0));
    for &size in sizes {
        if pixels(size) > pixels(first) {
            (first, second) = (size, first);
        } else if pixels(size) > pixels(second) {
            second = size;
        }
    }
    let job = Job { photos: [first, second], depth: [false; 2], matches: false, masked: [false; 2] };
    (Memory::of(job, options).unhalved(), first)
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn larger_photos_take_more() {
        let options = Options::default();
        let bytes = |width: usize| Budget::of(&[(width, 2000); 5], 0, &options).bytes((0, 0));
        for width in (500..9000).step_by(100) {
            assert!(bytes(width + 100) > bytes(width), "{width}: {} bytes, then {}", bytes(width), bytes(width + 100));
        }
    }
}
