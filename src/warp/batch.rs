//! Covered pixels between rasterisation and void recovery: found up to four at a time, processed four by four.

use wide::{f32x4, i8x16, i32x4};

use crate::lanes::LANES;

/// Pixels in a batch, at most.
pub(super) const BATCH: usize = 1024;

/// Four covered pixels, one to a lane.
pub(super) struct Covered {
    /// In reference coordinates.
    pub x: i32x4,
    pub y: i32x4,
    /// Positions of the pixels along the row of cells, in cells: integers at the corners.
    pub u: f32x4,
    /// Positions across it, 0 at the upper and 1 at the lower corners.
    pub v: f32x4,
    /// Not 0 where the cell is longer than the limit.
    pub stretched: i32x4,
}

/// Covered pixels in the order in which they were found, without gaps: one list per field of [`Covered`].
pub(super) struct Batch {
    lists: [[i32; BATCH]; 5],
    pub count: usize,
}

impl Batch {
    pub fn new() -> Self {
        Self { lists: [[0; BATCH]; 5], count: 0 }
    }

    /// Whether there is no room for four more pixels.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count > BATCH - LANES
    }

    /// Appends the pixels of the lanes whose bit is set. To avoid branches all four lanes are written, the set ones first;
    /// later pixels overwrite the rest.
    #[inline(always)]
    pub fn push(&mut self, lanes: i32, Covered { x, y, u, v, stretched }: Covered) {
        let order = TOGETHER[lanes as usize % TOGETHER.len()];
        let at = self.count.min(BATCH - LANES);
        for (list, numbers) in self.lists.iter_mut().zip([x, y, bytemuck::cast(u), bytemuck::cast(v), stretched]) {
            let together = bytemuck::cast::<_, i8x16>(numbers).swizzle(order);
            list[at..at + LANES].copy_from_slice(&bytemuck::cast::<_, [i32; LANES]>(together));
        }
        self.count = at + lanes.count_ones() as usize;
    }

    /// The pixels in fours. Lanes beyond the last pixel hold arbitrary values.
    #[inline(always)]
    pub fn fours(&self) -> impl Iterator<Item = Covered> {
        (0..self.count.div_ceil(LANES).min(BATCH / LANES)).map(|k| {
            let [x, y, u, v, stretched] = [0, 1, 2, 3, 4].map(|i: usize| i32x4::new(self.lists[i].as_chunks().0[k]));
            Covered { x, y, u: bytemuck::cast(u), v: bytemuck::cast(v), stretched }
        })
    }
}

/// For each set of lanes the byte shuffle that moves them to the front.
const TOGETHER: [i8x16; 1 << LANES] = {
    let mut orders = [i8x16::new([0; 16]); 1 << LANES];
    let mut lanes = 0;
    while lanes < orders.len() {
        let (mut order, mut count, mut byte) = ([0; 16], 0, 0);
        while byte < 16 {
            if lanes >> (byte / 4) & 1 != 0 {
                order[count] = byte as i8;
                count += 1;
            }
            byte += 1;
        }
        orders[lanes] = i8x16::new(order);
        lanes += 1;
    }
    orders
};
