//! How far straight lines of a photo would be from straight in the other's view.

use crate::features::LineSegment;

/// Points of a line that are looked at, and the fewest that have to show.
const POINTS: usize = 9;
const FEWEST: usize = 5;
/// Lines that curve more are all the same.
const MOST: f64 = 0.1;

/// By how much straight lines would curve: the mean of how wide a strip holds the image of each, as a share of its length, weighted by how long
/// it is. `place` says where a point lands, `None` where it does not show.
pub(super) fn curvature(lines: &[LineSegment], place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for line in lines {
        let [[x, y], [u, v]] = [line.start, line.end];
        let along = (0..POINTS).map(|k| k as f64 / (POINTS - 1) as f64);
        let places: Vec<_> = along.filter_map(|t| place([x + (u - x) * t, y + (v - y) * t])).collect();
        if let (true, [first, .., last]) = (places.len() >= FEWEST, &places[..]) {
            let length = line.length() * places.len() as f64 / POINTS as f64;
            sum += length * strip(*first, *last, &places).min(MOST);
            total += length;
        }
    }
    if total > 0.0 { sum / total } else { 0.0 }
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
    use super::*;

    fn line(start: [f64; 2], end: [f64; 2]) -> LineSegment {
        LineSegment { start, end, width: 1.0, significance: 1.0 }
    }

    #[test]
    fn an_arc_curves_by_its_sagitta_and_a_perspective_image_of_a_line_does_not() {
        let lines = [line([0.0, 0.0], [100.0, 0.0]), line([10.0, 50.0], [90.0, 20.0])];
        let perspective = |[x, y]: [f64; 2]| Some([x / (1.0 + 0.002 * y), (y + 0.3 * x) / (1.0 + 0.002 * y)]);
        assert!(curvature(&lines, &perspective) < 1e-12);
        // A parabola through the ends that is 4 beside the middle of the chord of 100.
        let arc = |[x, y]: [f64; 2]| Some([x, y + x * (100.0 - x) / 625.0]);
        assert!((curvature(&lines[..1], &arc) - 0.04).abs() < 1e-12);
        // Its half that shows curves by a quarter of that, on a chord of half the length.
        let half = |point: [f64; 2]| arc(point).filter(|_| point[0] <= 50.0);
        let chord = (50.0f64 * 50.0 + 16.0).sqrt();
        assert!((curvature(&lines[..1], &half) - 50.0 / (chord * chord)).abs() < 1e-3);
        // One of which too little shows counts as none.
        assert_eq!(curvature(&lines[..1], &|point| arc(point).filter(|_| point[0] <= 40.0)), 0.0);
    }
}
