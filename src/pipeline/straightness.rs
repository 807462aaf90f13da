//! How far straight lines of a photo would be from straight in the other's view.

use crate::features::LineSegment;

/// Points of a line that are looked at, and the fewest that have to show.
const POINTS: usize = 9;
const FEWEST: usize = 2;
/// Lines that curve more are all the same.
const MOST: f64 = 0.1;
/// From the first on a line starts to look bent, and from the second on it does: a kink of 2° in its middle is between them.
const BENT: [f64; 2] = [0.006, 0.012];

/// How straight lines come out, as means over all that show, weighted by the length that does.
pub(super) struct Straightness {
    /// How wide a strip holds the image of a line, as a share of its length.
    pub curvature: f64,
    /// The share that looks bent.
    pub bent: f64,
}

/// By how much straight lines would curve: where a line shows in part, the other photo shows the rest, and a kink between them is seen. `place` says
/// where a point lands, and `shows` whether it is this photo that shows there.
pub(super) fn straightness(
    lines: &[LineSegment],
    place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>,
    shows: &dyn Fn([f64; 2]) -> bool,
) -> Straightness {
    let (mut curvature, mut bent, mut total) = (0.0, 0.0, 0.0);
    for line in lines {
        let [[x, y], [u, v]] = [line.start, line.end];
        let along = (0..POINTS).map(|k| k as f64 / (POINTS - 1) as f64);
        let points = along.map(|t| [x + (u - x) * t, y + (v - y) * t]);
        let shown = points.clone().filter(|point| shows(*point)).count();
        let places: Vec<_> = points.filter_map(place).collect();
        if let (true, [first, .., last]) = (shown >= FEWEST, &places[..]) {
            let length = line.length() * shown as f64 / POINTS as f64;
            let strip = strip(*first, *last, &places).min(MOST);
            let [from, to] = BENT;
            curvature += length * strip;
            bent += length * ((strip - from) / (to - from)).clamp(0.0, 1.0);
            total += length;
        }
    }
    let mean = |sum: f64| if total > 0.0 { sum / total } else { 0.0 };
    Straightness { curvature: mean(curvature), bent: mean(bent) }
}

/// How wide the strip along the chord from `first` to `last` is that holds all `places`, as a share of the chord.
fn strip(first: [f64; 2], last: [f64; 2], places: &[[f64; 2]]) -> f64 {
    let chord = [last[0] - first[0], last[1] - first[1]];
    let squared = chord[0] * chord[0] + chord[1] * chord[1];
    if squared == 0.0 {
        return MOST;
    }
    let beside = places.iter().map(|p| ((p[0] - first[0]) * chord[1] - (p[1] - first[1]) * chord[0]) / squared);
    let (low, high) = beside.fold((0.0f64, 0.0f64), |(low, high), side| (low.min(side), high.max(side)));
    high - low
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    fn line(start: [f64; 2], end: [f64; 2]) -> LineSegment {
        LineSegment { start, end, width: 1.0, significance: 1.0 }
    }

    #[test]
    fn an_arc_curves_by_its_sagitta_and_a_perspective_image_of_a_line_does_not() {
        let lines = [line([0.0, 0.0], [100.0, 0.0]), line([10.0, 50.0], [90.0, 20.0])];
        let perspective = |[x, y]: [f64; 2]| Some([x / (1.0 + 0.002 * y), (y + 0.3 * x) / (1.0 + 0.002 * y)]);
        let straight = straightness(&lines, &perspective, &|_| true);
        assert!(straight.curvature < 1e-12 && straight.bent == 0.0);
        // A parabola through the ends, so far beside the middle of the chord of 100.
        let arc = |sagitta: f64| move |[x, y]: [f64; 2]| Some([x, y + sagitta * x * (100.0 - x) / 2500.0]);
        for (sagitta, bent) in [(4.0, 1.0), (0.9, 0.5), (0.5, 0.0)] {
            let found = straightness(&lines[..1], &arc(sagitta), &|_| true);
            assert!((found.curvature - 0.01 * sagitta).abs() < 1e-12 && (found.bent - bent).abs() < 1e-9, "{sagitta}");
        }
        // The other photo shows the rest of what shows in part, and counts less.
        let found = straightness(&lines, &arc(4.0), &|point| point[0] <= 20.0 || point[1] > 10.0);
        let [part, whole] = [2.0 / 9.0 * 100.0, lines[1].length()];
        let other = straightness(&lines[1..], &arc(4.0), &|_| true);
        assert!((found.curvature - (part * 0.04 + whole * other.curvature) / (part + whole)).abs() < 1e-12);
        // One of which too little shows counts as none.
        assert_eq!(straightness(&lines[..1], &arc(4.0), &|point| point[0] <= 10.0).curvature, 0.0);
    }
}
