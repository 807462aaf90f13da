//! One segment for a straight edge that was found in parts, as where the background changes behind it.

use super::LineSegment;

/// Lengthens segments of `min_length` or more by those that continue them, and drops the others: both ends are within `tolerance` of the line, and
/// the gap is at most `max_gap`, all in pixels. Which side is darker does not matter. Width and significance stay those of the longest part. Parts
/// that are all short, as of a dashed line or a wall of stones, are not joined.
pub fn join_collinear(
    mut segments: Vec<LineSegment>,
    min_length: f64,
    tolerance: f64,
    max_gap: f64,
) -> Vec<LineSegment> {
    let mut joined = Vec::new();
    while let Some(longest) = longest(&segments).filter(|&i| segments[i].length() >= min_length) {
        let mut whole = segments.swap_remove(longest);
        // What is longer reaches what it did not before.
        loop {
            let before = segments.len();
            segments.retain(|part| match union(&whole, part, tolerance, max_gap) {
                Some(longer) => {
                    whole = longer;
                    false
                }
                None => true,
            });
            if segments.len() == before {
                break;
            }
        }
        joined.push(whole);
    }
    joined
}

fn longest(segments: &[LineSegment]) -> Option<usize> {
    (0..segments.len()).max_by(|&a, &b| segments[a].length().total_cmp(&segments[b].length()))
}

/// Both in one, if `part` continues `whole`.
fn union(whole: &LineSegment, part: &LineSegment, tolerance: f64, max_gap: f64) -> Option<LineSegment> {
    let length = whole.length();
    let along = [0, 1].map(|k| (whole.end[k] - whole.start[k]) / length);
    let within = |[x, y]: [f64; 2]| {
        let [x, y] = [x - whole.start[0], y - whole.start[1]];
        let beside = x * along[1] - y * along[0];
        (beside.abs() <= tolerance).then_some(x * along[0] + y * along[1])
    };
    let ends = [(within(part.start)?, part.start), (within(part.end)?, part.end)];
    let [first, last] = if ends[0].0 < ends[1].0 { ends } else { [ends[1], ends[0]] };
    if first.0 > length + max_gap || last.0 < -max_gap {
        return None;
    }
    let start = if first.0 < 0.0 { first.1 } else { whole.start };
    let end = if last.0 > length { last.1 } else { whole.end };
    Some(LineSegment { start, end, ..*whole })
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    fn segment(start: [f64; 2], end: [f64; 2]) -> LineSegment {
        LineSegment { start, end, width: 1.0, significance: 1.0 }
    }

    #[test]
    fn parts_of_a_line_are_one_whatever_side_is_dark_and_others_are_not() {
        let parts = vec![
            segment([30.0, 31.0], [50.0, 50.0]),
            segment([0.0, 0.0], [28.0, 28.0]),
            // The other way round, and only next to the one before.
            segment([60.0, 60.5], [52.0, 52.0]),
            // Too far away, beside, and across.
            segment([80.0, 80.0], [90.0, 90.0]),
            segment([0.0, 5.0], [26.0, 31.0]),
            segment([20.0, 10.0], [12.0, 22.0]),
        ];
        let joined = join_collinear(parts.clone(), 14.2, 1.5, 5.0);
        assert_eq!(joined, [segment([0.0, 0.0], [60.0, 60.5]), parts[4], parts[5]]);
        assert_eq!(join_collinear(parts, 40.0, 1.5, 5.0), []);
    }
}
