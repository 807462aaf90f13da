//! Points all over the overlap, followed from where the models put them to where they are.
//!
//! B. Lucas & T. Kanade, *An Iterative Image Registration Technique*, IJCAI 1981; with the gradient of the template
//! throughout, as S. Baker & I. Matthews, *Lucas-Kanade 20 Years On*, IJCV 56 (2004).

use super::luma::{Luma, luma};
use crate::geometry::{Match, Model};
use crate::image::check_size;
use crate::observer::{Observer, report};
use crate::{ImageView, InverseDepth, Result, Stage};

/// Points that are tried, about.
const POINTS: f64 = 2000.0;
/// Side of a window, and half of it.
const SIDE: usize = 15;
const RADIUS: usize = SIDE / 2;
const AREA: usize = SIDE * SIDE;
/// Neighbours in a window that come from farther apart in the target, in pixels, do not belong together.
const TORN: f32 = 2.0;
/// How far a point may be from where the models put it, in pixels.
const REACH: f32 = 2.0;
/// A step shorter than this is the last one, in pixels.
const EXACT: f32 = 0.01;
const STEPS: usize = 12;
/// Least mean squared slope in the direction where it is least, in grey levels per pixel.
const LEAST_SLOPE: f32 = 0.05;
/// How much of its contrast a window may miss: twice what the correlation of the windows lacks.
const MISSED: f32 = 0.2;

type Window = [f32; AREA];

/// Adds matches on a grid over the reference, wherever there is texture: what the reverse model and the inverse depth of the
/// reference say that the target looks like there is moved to where the reference looks like it. Exposure plays no part.
/// Models and depth must be right to two pixels already.
///
/// # Errors
/// `size-mismatch` for a depth map of another size than the reference, `out-of-memory`, `aborted`.
pub fn track(
    target: ImageView<'_>,
    reference: ImageView<'_>,
    depth: &InverseDepth,
    reverse: &Model,
    matches: &mut Vec<Match>,
    observer: &mut dyn Observer,
) -> Result<()> {
    let (width, height) = (reference.width(), reference.height());
    check_size("referenceDepth", (depth.width(), depth.height()), (width, height))?;
    let photos = [luma(target, (target.width(), target.height()))?, luma(reference, (width, height))?];
    let scene = Scene { photos, depth, reverse };
    let step = (((width * height) as f64 / POINTS).sqrt() as usize).max(RADIUS);
    let mut y = RADIUS;
    while y + RADIUS < height {
        report(observer, Stage::Estimate, y as f32 / height as f32)?;
        let mut x = RADIUS;
        while x + RADIUS < width {
            if let Some(found) = scene.follow(x, y) {
                matches.push(found);
            }
            x += step;
        }
        y += step;
    }
    Ok(())
}

struct Scene<'a> {
    /// Target and reference.
    photos: [Luma; 2],
    depth: &'a InverseDepth,
    reverse: &'a Model,
}

impl Scene<'_> {
    /// Where a pixel of the reference lies in the target.
    #[inline(never)]
    fn source(&self, x: usize, y: usize) -> Option<[f64; 2]> {
        self.reverse.project(x as f64, y as f64, f64::from(self.depth.data()[y * self.depth.width() + x]))
    }

    /// The match of the reference's pixel (x, y), which must be [`RADIUS`] from the border.
    #[inline(never)]
    fn follow(&self, x: usize, y: usize) -> Option<Match> {
        let (mut sources, mut places) = ([[0.0; 2]; AREA], [[0.0f32; 2]; AREA]);
        let mut before = [0.0; 2];
        for (k, (source, place)) in sources.iter_mut().zip(&mut places).enumerate() {
            let (x, y) = (x + k % SIDE - RADIUS, y + k / SIDE - RADIUS);
            *source = self.source(x, y)?.map(|v| v as f32);
            *place = [x as f32, y as f32];
            let [u, v] = *source;
            if k % SIDE > 0 && (u - before[0]).abs() + (v - before[1]).abs() > TORN {
                return None;
            }
            before = [u, v];
        }
        let template = Template::new(window(&self.photos[0], &sources)?)?;
        let mut moved = [0.0; 2];
        for _ in 0..STEPS {
            let (step, missed) = template.step(&window(&self.photos[1], &places)?);
            places.iter_mut().for_each(|[x, y]| (*x, *y) = (*x + step[0], *y + step[1]));
            moved = [moved[0] + step[0], moved[1] + step[1]];
            let square = |[x, y]: [f32; 2]| x * x + y * y;
            // Not a number is far, too.
            let near = square(moved) <= REACH * REACH;
            if !near || square(step) < EXACT * EXACT {
                let target = self.source(x, y)?;
                return (near && missed < MISSED * template.contrast)
                    .then_some(Match { target, reference: places[AREA / 2].map(f64::from) });
            }
        }
        None
    }
}

/// The value between four pixels; `None` beyond the border.
#[inline(never)]
fn between(Luma { data, width, .. }: &Luma, x: f32, y: f32) -> Option<f32> {
    if !(x >= 0.0 && y >= 0.0 && x < (width - 1) as f32) {
        return None;
    }
    let first = y as usize * width + x as usize;
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let (above, below) = (data.get(first..first + 2)?, data.get(first + width..first + width + 2)?);
    let across = |pair: &[f32]| pair[0] + fx * (pair[1] - pair[0]);
    Some(across(above) + fy * (across(below) - across(above)))
}

/// What a photo shows at these places, less its mean, and the sum of squares.
#[inline(never)]
fn window(photo: &Luma, places: &[[f32; 2]; AREA]) -> Option<(Window, f32)> {
    let (mut window, mut mean, mut square) = ([0.0; AREA], 0.0, 0.0);
    for (value, &[x, y]) in window.iter_mut().zip(places) {
        *value = between(photo, x, y)?;
        mean += *value / AREA as f32;
    }
    for value in &mut window {
        *value -= mean;
        square += *value * *value;
    }
    Some((window, square))
}

/// What is looked for.
struct Template {
    values: Window,
    /// Sum of squares.
    contrast: f32,
    /// The gradient, 0 at the ends of the rows, which have no neighbour there; its second moments xx, xy and yy.
    slopes: [[f32; 2]; AREA],
    moments: [f32; 3],
}

/// The pixels of a window that have one above and one below.
const MIDDLE: std::ops::Range<usize> = SIDE + 1..SIDE * (SIDE - 1) - 1;

impl Template {
    /// `None` without texture.
    #[inline(never)]
    fn new((values, contrast): (Window, f32)) -> Option<Self> {
        let mut slopes = [[0.0; 2]; AREA];
        let [mut xx, mut xy, mut yy] = [0.0f32; 3];
        for k in MIDDLE {
            if k % SIDE > 0 && k % SIDE < SIDE - 1 {
                let (dx, dy) = (0.5 * (values[k + 1] - values[k - 1]), 0.5 * (values[k + SIDE] - values[k - SIDE]));
                (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
                slopes[k] = [dx, dy];
            }
        }
        let least = 0.5 * (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt());
        (least >= LEAST_SLOPE * AREA as f32).then_some(Self { values, contrast, slopes, moments: [xx, xy, yy] })
    }

    /// How far to move what was seen to make it look like this, and what it misses of it, squared.
    #[inline(never)]
    fn step(&self, (seen, brightness): &(Window, f32)) -> ([f32; 2], f32) {
        let gain = (self.contrast / brightness).sqrt();
        let [mut x, mut y, mut missed] = [0.0f32; 3];
        for k in MIDDLE {
            let ([dx, dy], off) = (self.slopes[k], self.values[k] - gain * seen[k]);
            (x, y, missed) = (x + dx * off, y + dy * off, missed + off * off);
        }
        let [xx, xy, yy] = self.moments;
        let inverse = 1.0 / (xx * yy - xy * xy);
        ([(yy * x - xy * y) * inverse, (xx * y - xy * x) * inverse], missed)
    }
}
