//! Minimum cut of a graph of grid cells by maximum flow.
//!
//! E. A. Dinic, *Algorithm for Solution of a Problem of Maximum Flow in a Network with Power Estimation*, Soviet Math. Doklady
//! 11 (1970): nodes are layered by their steps to the sink, and flow is sent down the layers until none gets through any
//! more; then they are layered anew, until the source is out of reach.

use crate::Result;
use crate::image::reserve;

/// Right, left, down, up: the opposite of `k` is `k ^ 1`.
pub(super) const NEIGHBOURS: [(isize, isize); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// The layer of a node that is out of reach.
const NEVER: u32 = u32::MAX;

#[derive(Clone, Copy)]
struct Node {
    next: [u32; 4],
    /// Residual capacity to each neighbour.
    rest: [i32; 4],
    /// Residual capacity from the source (positive) or to the sink (negative).
    terminal: i32,
    layer: u32,
    /// The first direction in which something may still get through this time; 4: none.
    open: usize,
}

/// A graph whose nodes have up to four neighbours, and links to the terminals: a source and a sink.
pub(super) struct Flow {
    nodes: Vec<Node>,
    /// Nodes by layer, or those on the way from the source to where the search is.
    path: Vec<u32>,
}

impl Flow {
    pub fn new(count: usize) -> Result<Self> {
        let alone = Node { next: [count as u32; 4], rest: [0; 4], terminal: 0, layer: NEVER, open: 0 };
        let (mut nodes, mut path) = (Vec::new(), Vec::new());
        reserve(&mut nodes, count + 1)?;
        // One more is everybody's missing neighbour: nothing flows to it or from it.
        nodes.resize(count + 1, alone);
        reserve(&mut path, count)?;
        Ok(Self { nodes, path })
    }

    /// Links a node to the source or the sink (t-link).
    pub fn terminal_link(&mut self, node: usize, source: bool, capacity: i32) {
        self.nodes[node].terminal += if source { capacity } else { -capacity };
    }

    /// Links a node to its neighbour in direction `k` (n-link). It must be linked back.
    pub fn neighbour_link(&mut self, node: usize, k: usize, neighbour: usize, capacity: i32) {
        self.nodes[node].next[k] = neighbour as u32;
        self.nodes[node].rest[k] = capacity;
    }

    /// Whether a node is on the source's side of the cut: what neither side claims is on the sink's.
    pub fn reached(&self, node: usize) -> bool {
        self.nodes[node].layer != NEVER
    }

    /// Lets as much flow as can.
    pub fn run(&mut self) {
        while self.layer(-1) {
            for node in 0..self.nodes.len() {
                while self.nodes[node].terminal > 0 && self.send(node) {}
            }
        }
        // What is left to say is what the source reaches.
        self.layer(1);
    }

    /// Layers the nodes by their steps from the source (`side` 1) or to the sink (−1); whether one is within reach of the other.
    #[inline(never)] // see `crate::rows`
    fn layer(&mut self, side: i32) -> bool {
        self.path.clear();
        for (i, node) in (0..).zip(&mut self.nodes) {
            (node.layer, node.open) = (NEVER, 0);
            if node.terminal * side > 0 {
                node.layer = 0;
                self.path.push(i);
            }
        }
        let mut end = NEVER;
        let mut first = 0;
        while let Some(&here) = self.path.get(first) {
            let layer = self.nodes[here as usize].layer;
            if layer >= end {
                break; // what is behind the end cannot be on a shortest way
            }
            for k in 0..NEIGHBOURS.len() {
                let Node { next, rest, .. } = &self.nodes[here as usize];
                let (next, rest) = (next[k], rest[k]);
                let node = &mut self.nodes[next as usize];
                let rest = if side > 0 { rest } else { node.rest[k ^ 1] };
                if rest > 0 && node.layer == NEVER {
                    node.layer = layer + 1;
                    end = if node.terminal * side < 0 { node.layer } else { end };
                    self.path.push(next);
                }
            }
            first += 1;
        }
        end != NEVER
    }

    /// Sends flow from a node that the source has something left for down the layers to the sink; whether any got through.
    #[inline(never)] // see `crate::rows`
    fn send(&mut self, start: usize) -> bool {
        self.path.clear();
        let mut here = start;
        while self.nodes[here].terminal >= 0 {
            let Node { next, rest, layer, open, .. } = &self.nodes[here];
            if let (Some(&next), Some(&rest)) = (next.get(*open), rest.get(*open)) {
                if rest > 0 && self.nodes[next as usize].layer.wrapping_add(1) == *layer {
                    self.path.push(here as u32);
                    here = next as usize;
                    continue;
                }
            } else if let Some(back) = self.path.pop() {
                here = back as usize;
            } else {
                return false;
            }
            self.nodes[here].open += 1;
        }
        let rest = |&node: &u32| self.nodes[node as usize].rest[self.nodes[node as usize].open];
        let most = self.nodes[start].terminal.min(-self.nodes[here].terminal);
        let amount = self.path.iter().map(rest).fold(most, i32::min);
        self.nodes[start].terminal -= amount;
        self.nodes[here].terminal += amount;
        for &node in &self.path {
            let Node { next, open, .. } = self.nodes[node as usize];
            self.nodes[node as usize].rest[open] -= amount;
            self.nodes[next[open] as usize].rest[open ^ 1] += amount;
        }
        true
    }
}
