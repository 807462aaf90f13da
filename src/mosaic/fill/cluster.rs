//! Voids far from one another are filled apart, each in a window of its own.

use super::super::crop::Rect;
use crate::image::{reserve, zeroed};
use crate::{Mask, Result};

/// Side of the tiles in which voids are looked for. Voids in tiles that touch belong together.
const TILE: usize = 32;
/// A tile with voids, not numbered yet.
const OPEN: u32 = u32::MAX;

/// The voids of a picture, sorted.
pub(super) struct Clusters<'a> {
    voids: &'a Mask,
    /// Number of the cluster in each tile, counted from 1; 0 without voids.
    tiles: Vec<u32>,
    /// Columns of tiles.
    columns: usize,
    /// Of every cluster, from the top.
    bounds: Vec<Rect>,
}

/// Voids that belong together.
pub(super) struct Cluster<'a> {
    clusters: &'a Clusters<'a>,
    number: u32,
    /// Holds them all, and perhaps others, too.
    pub bounds: Rect,
}

impl<'a> Clusters<'a> {
    pub fn of(voids: &'a Mask) -> Result<Self> {
        let columns = voids.width.div_ceil(TILE);
        let mut tiles: Vec<u32> = zeroed(columns * voids.height.div_ceil(TILE))?;
        for (rows, tiles) in voids.data.chunks(TILE * voids.width).zip(tiles.chunks_exact_mut(columns)) {
            for row in rows.chunks_exact(voids.width) {
                for (tile, cells) in tiles.iter_mut().zip(row.chunks(TILE)) {
                    // Without a branch, for the compiler to turn into SIMD.
                    *tile |= u32::from(cells.iter().fold(0, |any, cell| any | cell));
                }
            }
        }
        tiles.iter_mut().for_each(|tile| *tile = if *tile != 0 { OPEN } else { 0 });
        let mut clusters = Self { voids, tiles, columns, bounds: Vec::new() };
        clusters.number_tiles()?;
        Ok(clusters)
    }

    pub fn iter(&'a self) -> impl Iterator<Item = Cluster<'a>> {
        (1..).zip(&self.bounds).map(|(number, &bounds)| Cluster { clusters: self, number, bounds })
    }

    fn number_tiles(&mut self) -> Result<()> {
        let (columns, rows) = (self.columns, self.tiles.len() / self.columns);
        let mut open = Vec::new();
        reserve(&mut open, self.tiles.len())?;
        for first in 0..self.tiles.len() {
            if self.tiles[first] != OPEN {
                continue;
            }
            reserve(&mut self.bounds, 1)?;
            let number = self.bounds.len() as u32 + 1;
            let (mut left, mut top, mut right, mut bottom) = (columns, rows, 0, 0);
            self.tiles[first] = number;
            open.push(first);
            while let Some(tile) = open.pop() {
                let (x, y) = (tile % columns, tile / columns);
                (left, top, right, bottom) = (left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1));
                for row in y.saturating_sub(1)..(y + 2).min(rows) {
                    for next in row * columns + x.saturating_sub(1)..row * columns + (x + 2).min(columns) {
                        if self.tiles[next] == OPEN {
                            self.tiles[next] = number;
                            open.push(next); // each tile once, so there is room
                        }
                    }
                }
            }
            let (x, y) = (left * TILE, top * TILE);
            let (width, height) = (self.voids.width.min(right * TILE) - x, self.voids.height.min(bottom * TILE) - y);
            self.bounds.push(Rect { x, y, width, height });
        }
        Ok(())
    }
}

impl Cluster<'_> {
    /// Whether the pixel is a void of this cluster.
    pub fn contains(&self, x: usize, y: usize) -> bool {
        let Clusters { voids, tiles, columns, .. } = self.clusters;
        voids.data[y * voids.width + x] != 0 && tiles[y / TILE * columns + x / TILE] == self.number
    }

    /// Whether the pixel is a void of any cluster.
    pub fn is_void(&self, x: usize, y: usize) -> bool {
        let voids = self.clusters.voids;
        voids.data[y * voids.width + x] != 0
    }
}
