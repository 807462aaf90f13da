//! Points on a grid over the overlap, tracked from where models and depth predict them.
//!
//! B. Lucas & T. Kanade, *An Iterative Image Registration Technique*, IJCAI 1981; with the gradient of the template
//! throughout, as S. Baker & I. Matthews, *Lucas-Kanade 20 Years On*, IJCV 56 (2004).

use super::luma::{Luma, visible_luma};
use crate::geometry::{Match, Model};
use crate::image::check_size;
use crate::observer::{Observer, report};
use crate::{ImageView, InverseDepth, Result, Stage};

/// Roughly how many points are tried.
const POINTS: f64 = 2000.0;
/// Side of a window, and half of it.
const SIDE: usize = 15;
const RADIUS: usize = SIDE / 2;
const AREA: usize = SIDE * SIDE;
/// Neighbours in a window whose places in the target are farther apart than this, in pixels, lie on different surfaces.
const DISCONTINUITY: f32 = 2.0;
/// Largest distance from the predicted place, in pixels.
const REACH: f32 = 2.0;
/// The iteration has converged when a step is shorter than this, in pixels.
const CONVERGED: f32 = 0.01;
/// Most iterations.
const STEPS: usize = 12;
/// Least eigenvalue of a window's structure tensor, per pixel, in squared gray levels (J. Shi & C. Tomasi, *Good Features to
/// Track*, CVPR 1994).
const LEAST_EIGENVALUE: f32 = 0.05;
/// Largest residual over [`MIDDLE`] as a share of the whole template's energy. Over all of it that would be 2·(1 − NCC), so NCC is about 0.9.
const RESIDUAL: f32 = 0.2;

type Window = [f32; AREA];

/// Adds matches on a grid over the reference, wherever there is texture. The target, resampled into the reference by the
/// reverse model and the reference's inverse depth, gives a template for each grid point, which is then aligned with the
/// reference by translation. Windows are normalised in mean and variance, so differences in exposure do not matter.
/// Models and depth must be accurate to two pixels already.
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
    let (width, height) = reference.size();
    check_size("referenceDepth", depth.size(), (width, height))?;
    let photos = [visible_luma(target)?, visible_luma(reference)?];
    let scene = Scene { photos, depth, reverse };
    let step = (((width * height) as f64 / POINTS).sqrt() as usize).max(RADIUS);
    let mut y = RADIUS;
    while y + RADIUS < height {
        report(observer, Stage::Estimate, y as f32 / height as f32)?;
        let mut x = RADIUS;
        while x + RADIUS < width {
            if let Some(found) = scene.track_point(x, y) {
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
    /// Where the model puts a pixel of the reference in the target.
    fn source(&self, x: usize, y: usize) -> Option<[f64; 2]> {
        self.reverse.project(x as f64, y as f64, f64::from(self.depth.data()[y * self.depth.width() + x]))
    }

    /// The match of the reference's pixel (x, y), which must be [`RADIUS`] from the border.
    fn track_point(&self, x: usize, y: usize) -> Option<Match> {
        let (mut sources, mut places) = ([[0.0; 2]; AREA], [[0.0f32; 2]; AREA]);
        let mut before = [0.0; 2];
        for (k, (source, place)) in sources.iter_mut().zip(&mut places).enumerate() {
            let (x, y) = (x + k % SIDE - RADIUS, y + k / SIDE - RADIUS);
            *source = self.source(x, y)?.map(|v| v as f32);
            *place = [x as f32, y as f32];
            let [u, v] = *source;
            if k % SIDE > 0 && (u - before[0]).abs() + (v - before[1]).abs() > DISCONTINUITY {
                return None;
            }
            before = [u, v];
        }
        let template = Template::new(window(&self.photos[0], &sources)?)?;
        let step = template.descend(|[dx, dy]| {
            places.iter_mut().for_each(|[x, y]| (*x, *y) = (*x + dx, *y + dy));
            window(&self.photos[1], &places)
        })?;
        let [x0, y0] = places[AREA / 2];
        let reference = [x0 + step[0], y0 + step[1]].map(f64::from);
        Some(Match { target: self.source(x, y)?, reference })
    }
}

/// Where the second photo shows what the first one shows at a point, to a fraction of a pixel; `map` says about where, for points
/// around it as well. `None` without texture, and where the photos do not agree.
pub(crate) fn align_patch(
    [first, second]: [&Luma; 2],
    [x, y]: [f64; 2],
    map: &dyn Fn([f64; 2]) -> Option<[f64; 2]>,
) -> Option<[f64; 2]> {
    let half = RADIUS as f64;
    let middle = map([x, y])?;
    let slope = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|k| (b[k] - a[k]) / (2.0 * half));
    let across = slope(map([x - half, y])?, map([x + half, y])?);
    let down = slope(map([x, y - half])?, map([x, y + half])?);
    let offset = |i: usize| i as f64 - half;
    let places = |origin: [f64; 2], across: [f64; 2], down: [f64; 2]| {
        let place = |k: usize| {
            let (dx, dy) = (offset(k % SIDE), offset(k / SIDE));
            [0, 1].map(|c| (origin[c] + across[c] * dx + down[c] * dy) as f32)
        };
        std::array::from_fn(place)
    };
    let template = Template::new(window(first, &places([x, y], [1.0, 0.0], [0.0, 1.0]))?)?;
    let (mut shift, mut at) = ([0.0f64; 2], middle);
    template.descend(|step| {
        // The shift is in the first photo's axes.
        shift = [shift[0] + f64::from(step[0]), shift[1] + f64::from(step[1])];
        at = [0, 1].map(|c| middle[c] + across[c] * shift[0] + down[c] * shift[1]);
        window(second, &places(at, across, down))
    })?;
    Some(at)
}

/// Bilinear value; `None` outside the image.
fn bilinear(Luma { data, width, height }: &Luma, x: f32, y: f32) -> Option<f32> {
    if !(x >= 0.0 && y >= 0.0 && x < (width - 1) as f32 && y < (height - 1) as f32) {
        return None;
    }
    let first = y as usize * width + x as usize;
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let (above, below) = (data.get(first..first + 2)?, data.get(first + width..first + width + 2)?);
    let across = |pair: &[f32]| pair[0] + fx * (pair[1] - pair[0]);
    Some(across(above) + fy * (across(below) - across(above)))
}

/// The photo's values at these places less their mean, and the sum of squares of that. Both are NaN where the photo is masked: then
/// the window has no texture, and looks like nothing.
fn window(photo: &Luma, places: &[[f32; 2]; AREA]) -> Option<(Window, f32)> {
    let (mut window, mut mean, mut square) = ([0.0; AREA], 0.0, 0.0);
    for (value, &[x, y]) in window.iter_mut().zip(places) {
        *value = bilinear(photo, x, y)?;
        mean += *value / AREA as f32;
    }
    for value in &mut window {
        *value -= mean;
        square += *value * *value;
    }
    Some((window, square))
}

/// The window that is looked for.
struct Template {
    values: Window,
    /// Sum of squares.
    contrast: f32,
    /// The gradient, 0 at the ends of the rows, which have no neighbour there; and its structure tensor xx, xy, yy.
    slopes: [[f32; 2]; AREA],
    moments: [f32; 3],
}

/// The pixels of a window that have neighbours above and below.
const MIDDLE: std::ops::Range<usize> = SIDE + 1..SIDE * (SIDE - 1) - 1;

impl Template {
    /// `None` without texture.
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
        (least >= LEAST_EIGENVALUE * AREA as f32).then_some(Self { values, contrast, slopes, moments: [xx, xy, yy] })
    }

    /// Takes Gauss–Newton steps until they converge; `seen` moves the window by a step and reads it. Returns the last one, by which the
    /// window is not moved any more; `None` unless it is near where it started, and looks like the template.
    fn descend(&self, mut seen: impl FnMut([f32; 2]) -> Option<(Window, f32)>) -> Option<[f32; 2]> {
        let square = |[x, y]: [f32; 2]| x * x + y * y;
        let (mut step, mut shift) = ([0.0; 2], [0.0; 2]);
        for _ in 0..STEPS {
            let (next, residual) = self.step(&seen(step)?);
            step = next;
            shift = [shift[0] + step[0], shift[1] + step[1]];
            // False for NaN as well.
            let near = square(shift) <= REACH * REACH;
            if !near || square(step) < CONVERGED * CONVERGED {
                return (near && residual < RESIDUAL * self.contrast).then_some(step);
            }
        }
        None
    }

    /// One Gauss–Newton step: how far to move the window that was seen, and the sum of squared differences.
    fn step(&self, (seen, brightness): &(Window, f32)) -> ([f32; 2], f32) {
        let gain = (self.contrast / brightness).sqrt();
        let [mut x, mut y, mut residual] = [0.0f32; 3];
        for k in MIDDLE {
            let ([dx, dy], off) = (self.slopes[k], self.values[k] - gain * seen[k]);
            (x, y, residual) = (x + dx * off, y + dy * off, residual + off * off);
        }
        let [xx, xy, yy] = self.moments;
        let inverse = 1.0 / (xx * yy - xy * xy);
        ([(yy * x - xy * y) * inverse, (xx * y - xy * x) * inverse], residual)
    }
}
