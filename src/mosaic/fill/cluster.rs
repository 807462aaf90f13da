//! Clusters of voids: those far from one another are filled separately, each in a window of its own.

use super::parts::{Part, Parts, TILE};
use crate::Result;
use crate::distance::STRAIGHT;
use crate::image::{reserve, zeroed};
use crate::rect::Rect;

/// Which void belongs to which cluster.
pub(super) struct Clusters {
    window: Rect,
    /// Of every tile the number of its cluster, counted from 1; 0 without one.
    tiles: Vec<u32>,
    /// Tiles in a row.
    columns: usize,
}

/// Voids that belong together.
pub(super) struct Cluster {
    number: u32,
    /// On the picture, tile by tile: it may leave it to the right and below.
    pub bounds: Rect,
    /// Half the width in pixels of the widest void.
    pub half_width: u32,
}

impl Clusters {
    /// The clusters of all voids, from the top.
    pub fn of(parts: &Parts) -> Result<(Self, Vec<Cluster>)> {
        let &Parts { window, parts: ref kinds, ref inwards } = parts;
        let columns = window.width.div_ceil(TILE);
        let rows = window.height.div_ceil(TILE);
        let mut tiles: Vec<u32> = zeroed(columns * rows)?;
        // How far the innermost void of a tile is from the nearest pixel to go by; 0 without voids.
        let mut depths: Vec<u16> = zeroed(columns * rows)?;
        for (at, (&kind, &inwards)) in kinds.iter().zip(inwards).enumerate() {
            if kind == Part::Void {
                let depth = &mut depths[at / window.width / TILE * columns + at % window.width / TILE];
                *depth = inwards.max(*depth);
            }
        }
        let (mut clusters, mut open) = (Vec::new(), Vec::new());
        reserve(&mut clusters, tiles.len())?;
        reserve(&mut open, tiles.len())?;
        for first in 0..tiles.len() {
            if depths[first] == 0 || tiles[first] != 0 {
                continue;
            }
            let number = clusters.len() as u32 + 1;
            let (mut left, mut top, mut right, mut bottom, mut half_width) = (columns, rows, 0, 0, 0);
            tiles[first] = number;
            open.push(first);
            while let Some(tile) = open.pop() {
                let (x, y) = (tile % columns, tile / columns);
                (left, top, right, bottom) = (left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1));
                half_width = depths[tile].max(half_width);
                for row in y.saturating_sub(1)..(y + 2).min(rows) {
                    for next in row * columns + x.saturating_sub(1)..row * columns + (x + 2).min(columns) {
                        if depths[next] != 0 && tiles[next] == 0 {
                            tiles[next] = number;
                            open.push(next); // each tile once, so there is room
                        }
                    }
                }
            }
            let (width, height) = ((right - left) * TILE, (bottom - top) * TILE);
            let bounds = Rect { x: window.x + left * TILE, y: window.y + top * TILE, width, height };
            clusters.push(Cluster { number, bounds, half_width: u32::from(half_width) / STRAIGHT });
        }
        Ok((Self { window, tiles, columns }, clusters))
    }

    /// The place in `parts` of a pixel of the window if it is a void of that cluster.
    pub fn find(&self, parts: &Parts, cluster: &Cluster, x: usize, y: usize) -> Option<usize> {
        let (x, y) = (x - self.window.x, y - self.window.y);
        let at = y * self.window.width + x;
        let tile = self.tiles[y / TILE * self.columns + x / TILE];
        (tile == cluster.number && parts.parts[at] == Part::Void).then_some(at)
    }
}
