//! Minimum cut of a graph of grid cells by maximum flow.
//!
//! R. K. Ahuja and J. B. Orlin, *Distance-Directed Augmenting Path Algorithms for Maximum Flow and Parametric Maximum Flow Problems*,
//! Naval Research Logistics 38 (1991): flow is sent from node to node, each a step nearer to the sink by its label. Where none is, the node
//! is farther away than it was labelled; once there is no node at some distance, all that are farther are cut off.

use crate::Result;
use crate::image::{reserve, zeroed};

/// Right, left, down, up: the opposite of `k` is `k ^ 1`.
pub(super) const NEIGHBOURS: [(isize, isize); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// The distance of a node that is out of reach.
const UNREACHABLE: u32 = u32::MAX;

#[derive(Clone, Copy)]
struct Node {
    next: [u32; 4],
    /// Residual capacity to each neighbour.
    rest: [i32; 4],
    /// Residual capacity from the source (positive) or to the sink (negative).
    terminal: i32,
    /// Steps from the source, or to the sink at least.
    distance: u32,
    /// The first direction in which something may still get through at this distance; 4: none.
    open: usize,
}

/// A graph whose nodes have up to four neighbours, and links to the terminals: a source and a sink.
pub(super) struct Flow {
    nodes: Vec<Node>,
    /// Nodes by distance, or those on the way from the source to where the search is.
    path: Vec<u32>,
    /// How many nodes there are at each distance from the sink.
    counts: Vec<u32>,
}

impl Flow {
    pub fn new(count: usize) -> Result<Self> {
        let alone = Node { next: [count as u32; 4], rest: [0; 4], terminal: 0, distance: UNREACHABLE, open: 0 };
        let (mut nodes, mut path) = (Vec::new(), Vec::new());
        reserve(&mut nodes, count + 1)?;
        // One more is everybody's missing neighbour: nothing flows to it or from it.
        nodes.resize(count + 1, alone);
        reserve(&mut path, count)?;
        Ok(Self { nodes, path, counts: zeroed(count)? })
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
        self.nodes[node].distance != UNREACHABLE
    }

    /// Lets as much flow as can.
    pub fn run(&mut self) {
        self.measure(-1);
        for node in &self.nodes {
            if let Some(count) = self.counts.get_mut(node.distance as usize) {
                *count += 1;
            }
        }
        for node in 0..self.nodes.len() {
            while self.nodes[node].terminal > 0 && self.send(node) {}
        }
        // What is left to say is what the source reaches.
        self.measure(1);
    }

    /// Measures the steps of all nodes from the source (`side` 1) or to the sink (−1), 0 for those that are linked to it.
    #[inline(never)] // see `crate::rows`
    fn measure(&mut self, side: i32) {
        self.path.clear();
        for (i, node) in (0..).zip(&mut self.nodes) {
            node.distance = UNREACHABLE;
            if node.terminal * side > 0 {
                node.distance = 0;
                self.path.push(i);
            }
        }
        let mut first = 0;
        while let Some(&here) = self.path.get(first) {
            let Node { next, rest, distance, .. } = self.nodes[here as usize];
            for k in 0..NEIGHBOURS.len() {
                let node = &mut self.nodes[next[k] as usize];
                let rest = if side > 0 { rest[k] } else { node.rest[k ^ 1] };
                if rest > 0 && node.distance == UNREACHABLE {
                    node.distance = distance + 1;
                    self.path.push(next[k]);
                }
            }
            first += 1;
        }
    }

    /// Sends flow from a node that the source has something left for to the sink; whether any got through.
    #[inline(never)] // see `crate::rows`
    fn send(&mut self, start: usize) -> bool {
        self.path.clear();
        let mut here = start;
        while self.nodes[here].terminal >= 0 {
            let Node { next, rest, distance, open, .. } = &self.nodes[here];
            if *distance == UNREACHABLE && here == start {
                return false;
            }
            if let (Some(&next), Some(&rest)) = (next.get(*open), rest.get(*open)) {
                if rest > 0 && distance.checked_sub(1) == Some(self.nodes[next as usize].distance) {
                    self.path.push(here as u32);
                    here = next as usize;
                } else {
                    self.nodes[here].open += 1;
                }
            } else {
                self.relabel(here);
                here = self.path.pop().map_or(start, |back| back as usize);
            }
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

    /// Puts a node one step behind the nearest neighbour that it may still send to.
    fn relabel(&mut self, node: usize) {
        let Node { next, rest, distance: before, .. } = self.nodes[node];
        let ahead = next.iter().zip(rest).filter(|(_, rest)| *rest > 0);
        let nearest = ahead.map(|(&next, _)| self.nodes[next as usize].distance).fold(UNREACHABLE, u32::min);
        let mut distance = nearest.saturating_add(1);
        match self.counts.get_mut(before as usize) {
            Some(1) => {
                // Nobody is left where the way of all that are farther away would lead through.
                self.counts[before as usize..].fill(0);
                self.nodes
                    .iter_mut()
                    .filter(|node| node.distance >= before)
                    .for_each(|node| node.distance = UNREACHABLE);
                distance = UNREACHABLE;
            }
            Some(count) => *count -= 1,
            None => {}
        }
        if let Some(count) = self.counts.get_mut(distance as usize) {
            *count += 1;
        } else {
            distance = UNREACHABLE;
        }
        (self.nodes[node].distance, self.nodes[node].open) = (distance, 0);
    }
}
