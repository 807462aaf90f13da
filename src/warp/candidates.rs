//! What is offered for the pixels of the canvas: where in the target it lies, and whether it is a void (paper, section
//! 3.2.2).

use wide::{CmpGt, CmpLt, f32x4, i32x4};

use super::WarpMode;
use super::canvas::Canvas;
use super::raster::{BATCH, Covered, LANES, NONE};
use super::render::Scene;
use super::sample::{Tap, Taps};
use crate::InverseDepth;
use crate::geometry::Model;

const SLOTS: usize = BATCH * LANES;

/// A batch of candidates.
pub(super) struct Candidates {
    list: [Candidate; SLOTS],
    count: usize,
}

/// What a cell offers for a pixel. Four are found at a time, and turned from one number of each to all numbers of one.
#[derive(Clone, Copy, Default)]
pub(super) struct Candidate {
    /// Indices: of the pixel of the canvas; of the reference's, −1 where it does not reach; of a [`Tap`], −1 for a void, and
    /// its nearest.
    places: i32x4,
    /// The shares of the [`Tap`]. The squared distance from its place in the target of where the reverse model sends the
    /// reference pixel, over β² (paper, equation 9): both that and 1 times the same factor, as floats.
    weights: i32x4,
}

impl Candidates {
    pub fn new() -> Self {
        Self { list: [Candidate::default(); SLOTS], count: 0 }
    }

    /// In the order of the groups and their lanes.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = &Candidate> {
        self.list.iter().take(self.count)
    }
}

impl Candidate {
    #[inline(always)]
    fn place(&self, lane: usize) -> usize {
        self.places.as_array_ref()[lane] as usize
    }

    #[inline(always)]
    fn weight(&self, lane: usize) -> i32 {
        self.weights.as_array_ref()[lane]
    }

    /// Index of the pixel of the canvas.
    #[inline(always)]
    pub fn at(&self) -> usize {
        self.place(0)
    }

    /// Index of the pixel of the reference, beyond all where there is none.
    #[inline(always)]
    pub fn index(&self) -> usize {
        self.place(1)
    }

    /// Whether it is a void.
    #[inline(always)]
    pub fn void(&self) -> bool {
        self.places.as_array_ref()[2] < 0
    }

    /// Whether it is where it should be by β, the square of which is divided by `strictness`.
    #[inline(always)]
    pub fn near(&self, strictness: f32) -> bool {
        let float = |lane| f32::from_bits(self.weight(lane) as u32);
        float(2) * strictness < float(3)
    }

    /// Where it is in the target.
    #[inline(always)]
    pub fn tap(&self) -> Tap {
        Tap { index: self.place(2), nearest: self.place(3), lower: self.weight(0), across: self.weight(1) }
    }
}

/// Makes candidates of covered pixels.
pub(super) struct Locator<'a> {
    canvas: &'a Canvas,
    reference: (usize, usize),
    reference_depth: Option<&'a [f32]>,
    target: (usize, usize),
    /// Width and height of a cell in target pixels.
    step: [f32x4; 2],
    reverse: Projection,
    /// Whether there are voids.
    recover: bool,
    /// 1/β², β in pixels of the target.
    per_place: f32,
}

impl<'a> Locator<'a> {
    pub fn new(scene: &Scene<'a>, canvas: &'a Canvas, step: [f64; 2]) -> Self {
        let size = (scene.target.width(), scene.target.height());
        let (w, h, place) = (size.0 as f64, size.1 as f64, scene.options.void_distance);
        Self {
            canvas,
            reference: (scene.reference.width(), scene.reference.height()),
            reference_depth: scene.reference_depth.map(InverseDepth::data),
            target: size,
            step: step.map(|step| f32x4::splat(step as f32)),
            reverse: Projection::new(scene.reverse),
            recover: scene.options.mode != WarpMode::Backward,
            per_place: (1.0 / (place * place * (w * w + h * h))) as f32,
        }
    }

    /// Looks at the pixels covered by cells of row `j`.
    #[inline(always)]
    pub fn locate(&self, groups: &[Covered], j: usize, out: &mut Candidates) {
        let (offset_x, offset_y) = self.canvas.offset;
        let shift = i32x4::splat((offset_y * self.canvas.width + offset_x) as i32);
        let stride = i32x4::splat(self.canvas.width as i32);
        let (width, height) = (i32x4::splat(self.reference.0 as i32), i32x4::splat(self.reference.1 as i32));
        let before = i32x4::splat(-1);
        let mut count = 0;
        for group in groups {
            let (x, y) = (group.x, group.y);
            let inside = x.cmp_gt(before) & x.cmp_lt(width) & y.cmp_gt(before) & y.cmp_lt(height);
            let index = y * width + x;
            let s = [
                (f32x4::splat(group.column as f32) + f32x4::new([0.0, 1.0, 2.0, 3.0]) + group.u) * self.step[0],
                (f32x4::splat(j as f32) + group.v) * self.step[1],
            ];
            let (mut distance, mut one) = (f32x4::ZERO, f32x4::ONE);
            let mut kept = !NONE;
            if self.recover {
                kept = !(inside | group.stretched);
                // Mostly all four are on the same side.
                if inside.move_mask() != 0 {
                    let index = index & inside;
                    let depth = |lane: usize| {
                        self.reference_depth.map_or(0.0, |depth| depth[index.as_array_ref()[lane] as usize])
                    };
                    let place = [f32x4::from_i32x4(x), f32x4::from_i32x4(y)];
                    let [u, v, w] = self.reverse.transform(place, f32x4::new([depth(0), depth(1), depth(2), depth(3)]));
                    let (dx, dy) = (u - s[0] * w, v - s[1] * w);
                    (distance, one) = ((dx * dx + dy * dy) * self.per_place, w * w);
                    let near: i32x4 = bytemuck::cast(w.cmp_gt(f32x4::ZERO) & distance.cmp_lt(one));
                    kept |= inside & near;
                }
            }
            let taps = Taps::new(s, self.target);
            let places = [y * stride + x + shift, index | !inside, taps.index | !kept, taps.nearest];
            let weights = [taps.lower, taps.across, bytemuck::cast(distance), bytemuck::cast(one)];
            let (places, weights) = (transpose(places), transpose(weights));
            let lanes = group.lanes;
            // Each is written, and stays if the cell covers a pixel: that takes no branch.
            for lane in 0..LANES {
                out.list[count % SLOTS] = Candidate { places: places[lane], weights: weights[lane] };
                count += (lanes >> lane & 1) as usize;
            }
        }
        out.count = count;
    }
}

/// Lane k of each becomes the k-th. (`wide` has this only for processors with SSE.)
#[inline(always)]
fn transpose([a, b, c, d]: [i32x4; 4]) -> [i32x4; 4] {
    let interleave = |p: i32x4, q: i32x4| {
        let (p, q) = (p.to_array(), q.to_array());
        [i32x4::new([p[0], q[0], p[1], q[1]]), i32x4::new([p[2], q[2], p[3], q[3]])]
    };
    let ([ac, ac2], [bd, bd2]) = (interleave(a, c), interleave(b, d));
    let ([first, second], [third, fourth]) = (interleave(ac, bd), interleave(ac2, bd2));
    [first, second, third, fourth]
}

/// A model in single precision, for four points at once.
struct Projection([[f32; 4]; 3]);

impl Projection {
    fn new(model: &Model) -> Self {
        let row = |i: usize| [model.h[(i, 0)], model.h[(i, 1)], model.h[(i, 2)], model.e[i]].map(|v| v as f32);
        Self([row(0), row(1), row(2)])
    }

    /// As [`Model::transform`].
    #[inline(always)]
    fn transform(&self, [x, y]: [f32x4; 2], d: f32x4) -> [f32x4; 3] {
        let row = |[a, b, c, e]: [f32; 4]| x * a + y * b + d * e + f32x4::splat(c);
        [row(self.0[0]), row(self.0[1]), row(self.0[2])]
    }
}
