//! Backward rendering of the warped cells (paper, section 3.2.1 and algorithm 2).

use super::batch::Batch;
use super::candidates::{Candidates, Locator};
use super::canvas::Canvas;
use super::grid::VertexGrid;
use super::raster::draw_row;
use super::scene::Scene;
use super::selection::Painter;
use super::stretch::StretchLimit;
use crate::observer::{Observer, report};
use crate::{Image, Mask, Result, Stage};

/// What is drawn into: empty and of the canvas' size.
pub(super) struct Output<'a> {
    /// Opaque where a candidate is accepted.
    pub image: &'a mut Image,
    /// Set where a candidate is offered.
    pub footprint: &'a mut Mask,
    /// Confidence of the accepted candidate, if that is wanted.
    pub confidence: Option<&'a mut Mask>,
}

/// Draws every cell of the grid. Returns the
/// target's own inverse depth at every pixel that shows it, with [`WarpOptions::depth`](super::WarpOptions), and anything
/// elsewhere; empty without a map.
pub(super) fn render(
    scene: &Scene<'_>,
    grid: &VertexGrid<'_>,
    canvas: &Canvas,
    out: &mut Output<'_>,
    observer: &mut dyn Observer,
) -> Result<Vec<f32>> {
    let mut painter = Painter::new(scene, canvas, out)?;
    let locator = Locator::new(scene, canvas, grid.step());
    let mut candidates = Candidates::new();
    let stretch = StretchLimit::new(grid, scene.options.stretch_limit)?;
    let [columns, rows] = grid.cells();
    let mut batch = Batch::new();
    grid.for_each_row(|j, above, below| {
        if j % 64 == 0 {
            report(observer, Stage::Warp, 0.2 + 0.8 * j as f32 / rows as f32)?;
        }
        draw_row(above, below, columns, j + 1 == rows, &stretch, &mut batch, |covered| {
            locator.locate(covered, j, &mut candidates);
            painter.offer(&candidates);
        });
        Ok(())
    })?;
    Ok(painter.depth)
}
