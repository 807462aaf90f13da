//! Straight lines of the target that the warp breaks.

use crate::InverseDepth;
use crate::features::LineSegment;
use crate::geometry::Model;
use crate::rect::diagonal;

/// Least length, as a share of the target's diagonal.
const LENGTH: f64 = 0.06;
/// Points of a line that are mapped.
const POINTS: usize = 25;
/// Pixels to either side at which a line is mapped, too: an occluding edge belongs to the nearer one of its sides.
const ASIDE: [f64; 3] = [-2.5, 0.0, 2.5];
/// cos 2°: a line whose halves differ by more is broken.
const STRAIGHT: f64 = 0.999_390_827_019_095_8;
/// A line with less than this share of its points on the one side of the reference's border lies on the other.
const FEW_POINTS: f64 = 0.05;
/// Fewer lines say nothing.
const FEW_LINES: usize = 5;

/// How many lines there are, and how many of them are broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineBreaks {
    /// Lines.
    pub lines: usize,
    /// Those whose two halves differ in direction by more than 2 degrees.
    pub broken: usize,
}

impl LineBreaks {
    /// Share of the lines that are broken, 0 to 1; `None` of fewer than five.
    pub fn share(&self) -> Option<f64> {
        (self.lines >= FEW_LINES).then(|| self.broken as f64 / self.lines as f64)
    }
}

/// Lines by where the warp puts them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BrokenLines {
    /// Within the reference.
    pub inside: LineBreaks,
    /// Across its border.
    pub across: LineBreaks,
    /// Where the target alone shows.
    pub outside: LineBreaks,
}

/// Which of the target's `segments` of 6 % of its diagonal or more are broken by `forward` with `depth` (0 everywhere where
/// there is none). `size` and `reference` are width and height of the photos. Lines behind the camera or at holes of the
/// depth are left out.
pub fn broken_lines(
    segments: &[LineSegment],
    size: (usize, usize),
    forward: &Model,
    depth: Option<&InverseDepth>,
    reference: (usize, usize),
) -> BrokenLines {
    let least = LENGTH * diagonal(size);
    let mut found = BrokenLines::default();
    for segment in segments.iter().filter(|segment| segment.length() > least) {
        let mapped = ASIDE.iter().filter_map(|&aside| map(segment, aside, forward, depth, reference));
        let best = mapped.reduce(|best, other| if other.straightness > best.straightness { other } else { best });
        let Some(Mapped { straightness, inside }) = best else { continue };
        let class = if inside > 1.0 - FEW_POINTS {
            &mut found.inside
        } else if inside >= FEW_POINTS {
            &mut found.across
        } else {
            &mut found.outside
        };
        class.lines += 1;
        class.broken += usize::from(straightness < STRAIGHT);
    }
    found
}

/// A line in the reference's frame.
struct Mapped {
    /// Cosine of the angle between its halves.
    straightness: f64,
    /// Share of its points within the reference.
    inside: f64,
}

/// The points of `segment`, `aside` pixels beside it, through the model.
fn map(
    segment: &LineSegment,
    aside: f64,
    forward: &Model,
    depth: Option<&InverseDepth>,
    (width, height): (usize, usize),
) -> Option<Mapped> {
    let ([x0, y0], [x1, y1]) = (segment.start, segment.end);
    let (dx, dy, length) = (x1 - x0, y1 - y0, segment.length());
    let mut points = [[0.0; 2]; POINTS];
    let mut inside = 0;
    for (i, point) in points.iter_mut().enumerate() {
        let t = i as f64 / (POINTS - 1) as f64;
        let (x, y) = (x0 + t * dx - dy / length * aside, y0 + t * dy + dx / length * aside);
        let d = depth.map_or(0.0, |depth| depth.sample(x, y));
        let [u, v] = forward.project(x, y, d)?;
        inside += usize::from(u >= 0.0 && v >= 0.0 && u < width as f64 && v < height as f64);
        *point = [u, v];
    }
    let (a, b) = (direction(&points[..=POINTS / 2])?, direction(&points[POINTS / 2..])?);
    Some(Mapped { straightness: (a[0] * b[0] + a[1] * b[1]).abs(), inside: inside as f64 / POINTS as f64 })
}

/// Unit vector along the first principal axis; `None` when the points are one.
fn direction(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for p in points {
        let (x, y) = (p[0] - mean[0], p[1] - mean[1]);
        (xx, yy, xy) = (xx + x * x, yy + y * y, xy + x * y);
    }
    let half = 0.5 * (xx - yy);
    let root = (half * half + xy * xy).sqrt();
    // From whichever row of the matrix is better conditioned.
    let [x, y] = if half > 0.0 { [half + root, xy] } else { [xy, root - half] };
    let norm = (x * x + y * y).sqrt();
    (norm > 0.0).then(|| [x / norm, y / norm])
}
