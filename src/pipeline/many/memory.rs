//! How much memory many photos take: as the two largest alone, and what is held of all.

use super::graph;
use crate::Result;
use crate::pipeline::memory::{FEATURE, Job, MAP, MASK, MASKED, Memory, RGBA, pixels, refuse_above};
use crate::pipeline::options::Options;

/// Bytes per pixel that are held of every photo, with the map through its landmarks and what stereo found.
const PHOTO: u64 = RGBA + 2 * MAP;
/// Features of a photo.
const FEATURES: u64 = graph::FEATURES as u64 * FEATURE;
/// Tracks of a photo, its landmarks, and their part of the equations of bundle adjustment.
const GEOMETRY: u64 = 600_000;
/// Per pixel of the canvas, besides what two photos take: the composition with its labels, footprint and depth.
const CANVAS: u64 = RGBA + 2 * MASK + MAP;

/// What will be taken, and what may be.
pub(crate) struct Budget<'a> {
    memory: Memory<'a>,
    options: &'a Options,
    largest: (usize, usize),
    held: u64,
    limit: u64,
}

impl<'a> Budget<'a> {
    /// Of photos of these sizes (width, height).
    pub fn of(sizes: impl Iterator<Item = (usize, usize)>, options: &'a Options) -> Self {
        let (mut first, mut second, mut held) = ((0, 0), (0, 0), 0u64);
        for size in sizes {
            held = held.saturating_add(pixels(size).saturating_mul(PHOTO)).saturating_add(FEATURES + GEOMETRY);
            if pixels(size) > pixels(first) {
                (first, second) = (size, first);
            } else if pixels(size) > pixels(second) {
                second = size;
            }
        }
        let job = Job { photos: [first, second], depth: [false; 2], matches: false, masked: [false; 2] };
        Self {
            memory: Memory::of(job, options).unhalved(),
            options,
            largest: first,
            held,
            limit: options.warp.max_bytes,
        }
    }

    /// Of what is held of a masked photo: a copy, and distances.
    pub fn add_masked(&mut self, size: (usize, usize)) {
        self.add(size, RGBA + MASKED);
    }

    /// Of a depth map that is given.
    pub fn add_depth(&mut self, size: (usize, usize)) {
        self.add(size, MAP);
    }

    /// Copies of the photos, and their depth, in frames of these sizes are held beside those given, and are what is worked on.
    ///
    /// # Errors
    /// `too-large`.
    pub fn undistort(&mut self, frames: &[(usize, usize)]) -> Result<()> {
        let held = self.held;
        *self = Self::of(frames.iter().copied(), self.options);
        self.held = held;
        frames.iter().for_each(|&frame| {
            self.add_masked(frame);
            self.add_depth(frame);
        });
        self.check((0, 0))
    }

    fn add(&mut self, size: (usize, usize), bytes_per_pixel: u64) {
        self.held = self.held.saturating_add(pixels(size).saturating_mul(bytes_per_pixel));
    }

    /// How many times over all of it may be taken, before the canvas is known.
    #[cfg(all(target_arch = "wasm32", feature = "wasm-many"))]
    pub fn times(&self) -> u64 {
        self.limit / self.bytes((0, 0)).max(1)
    }

    /// What is predicted with this canvas.
    fn bytes(&self, canvas: (usize, usize)) -> u64 {
        let own = self.held.saturating_add(pixels(canvas).saturating_mul(CANVAS));
        self.memory.peak(canvas).1.saturating_add(own)
    }

    /// Refuses what would take more than is allowed with this canvas.
    ///
    /// # Errors
    /// `too-large`.
    pub fn check(&self, canvas: (usize, usize)) -> Result<()> {
        refuse_above(self.limit, self.bytes(canvas), if canvas.0 > 0 { canvas } else { self.largest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_photos_take_more() {
        let options = Options::default();
        let bytes = |width: usize| Budget::of([(width, 2000); 5].into_iter(), &options).bytes((0, 0));
        for width in (500..9000).step_by(100) {
            assert!(bytes(width + 100) > bytes(width), "{width}: {} bytes, then {}", bytes(width), bytes(width + 100));
        }
    }
}
