//! Minimum cut of a graph of grid cells by maximum flow.
//!
//! Y. Boykov and V. Kolmogorov, *An Experimental Comparison of Min-Cut/Max-Flow Algorithms for Energy Minimization in
//! Vision*, PAMI 26 (2004): two search trees grow from the source and the sink; where they meet flow is sent, and what it
//! cuts off is adopted by the rest of its tree if it can be. Distances to the root are kept with time stamps, as in
//! the authors' program, so that trees stay shallow.

use crate::Result;
use crate::image::{reserve, zeroed};

/// Right, left, down, up: the opposite of `k` is `k ^ 1`.
pub(super) const NEIGHBOURS: [(isize, isize); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// Instead of the direction of the parent: the source or the sink itself, or nobody.
const ROOT: u8 = 4;
const NOBODY: u8 = 5;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Tree {
    None,
    Source,
    Sink,
}

#[derive(Clone, Copy)]
struct Node {
    next: [u32; 4],
    /// What may still flow to each neighbour.
    rest: [i32; 4],
    /// What may still flow from the source (positive) or to the sink (negative).
    terminal: i32,
    /// When the distance was last known to be right.
    time: u32,
    /// Steps to the root.
    distance: u32,
    tree: Tree,
    parent: u8,
    active: bool,
}

/// A graph whose nodes have up to four neighbours, and ties to a source and a sink.
pub(super) struct Flow {
    nodes: Vec<Node>,
    /// A ring: a node is in it at most once.
    active: Vec<u32>,
    first: usize,
    waiting: usize,
    orphans: Vec<u32>,
    time: u32,
}

impl Flow {
    pub fn new(count: usize) -> Result<Self> {
        let alone = Node {
            next: [count as u32; 4],
            rest: [0; 4],
            terminal: 0,
            time: 0,
            distance: 0,
            tree: Tree::None,
            parent: NOBODY,
            active: false,
        };
        let mut nodes = Vec::new();
        reserve(&mut nodes, count + 1)?;
        // One more is everybody's missing neighbour: nothing flows to it or from it.
        nodes.resize(count + 1, alone);
        let mut orphans = Vec::new();
        reserve(&mut orphans, count)?;
        Ok(Self { nodes, active: zeroed(count)?, first: 0, waiting: 0, orphans, time: 0 })
    }

    /// Ties a node to the source or the sink.
    pub fn tie(&mut self, node: usize, source: bool, capacity: i32) {
        self.nodes[node].terminal += if source { capacity } else { -capacity };
    }

    /// Lets `capacity` flow from a node to its neighbour in direction `k`. It must be linked back.
    pub fn link(&mut self, node: usize, k: usize, neighbour: usize, capacity: i32) {
        self.nodes[node].next[k] = neighbour as u32;
        self.nodes[node].rest[k] = capacity;
    }

    /// Whether a node is on the source's side of the cut: what neither side claims is on the sink's.
    pub fn reached(&self, node: usize) -> bool {
        self.nodes[node].tree == Tree::Source
    }

    /// Lets as much flow as can.
    pub fn run(&mut self) {
        for i in 0..self.nodes.len() {
            let node = &mut self.nodes[i];
            if node.terminal != 0 {
                node.tree = if node.terminal > 0 { Tree::Source } else { Tree::Sink };
                (node.parent, node.distance) = (ROOT, 1);
                self.activate(i);
            }
        }
        while self.waiting > 0 {
            let here = self.active[self.first] as usize;
            if self.nodes[here].tree == Tree::None {
                self.retire(here);
                continue;
            }
            let meeting = self.grow(here);
            self.time += 1;
            match meeting {
                Some((node, k)) => {
                    self.augment(node, k);
                    while let Some(orphan) = self.orphans.pop() {
                        self.adopt(orphan as usize);
                    }
                }
                None => self.retire(here),
            }
        }
    }

    #[inline(never)]
    fn activate(&mut self, node: usize) {
        if !self.nodes[node].active {
            self.nodes[node].active = true;
            let at = (self.first + self.waiting) % self.active.len();
            self.active[at] = node as u32;
            self.waiting += 1;
        }
    }

    fn retire(&mut self, node: usize) {
        self.nodes[node].active = false;
        self.first = (self.first + 1) % self.active.len();
        self.waiting -= 1;
    }

    /// Takes free neighbours into the tree, until the other tree is met: at the arc from the source's tree to the
    /// sink's that is returned.
    fn grow(&mut self, here: usize) -> Option<(usize, usize)> {
        let node = self.nodes[here];
        for k in 0..4 {
            let there = node.next[k] as usize;
            let open = if node.tree == Tree::Source { node.rest[k] } else { self.nodes[there].rest[k ^ 1] } > 0;
            if !open {
                continue;
            }
            let other = &mut self.nodes[there];
            if other.tree == Tree::None {
                (other.tree, other.parent) = (node.tree, k as u8 ^ 1);
                (other.time, other.distance) = (node.time, node.distance + 1);
                self.activate(there);
            } else if other.tree != node.tree {
                return Some(if node.tree == Tree::Source { (here, k) } else { (there, k ^ 1) });
            } else if other.time <= node.time && other.distance > node.distance {
                // A shorter way to the root.
                other.parent = k as u8 ^ 1;
                (other.time, other.distance) = (node.time, node.distance + 1);
            }
        }
        None
    }

    /// Sends all that can go from the source to the sink through an arc between the trees.
    fn augment(&mut self, node: usize, k: usize) {
        let other = self.nodes[node].next[k] as usize;
        let mut amount = self.nodes[node].rest[k];
        for start in [node, other] {
            let mut here = start;
            while let Some((parent, up)) = self.parent(here) {
                let forwards = self.nodes[here].tree == Tree::Source;
                amount = amount.min(if forwards { self.nodes[parent].rest[up ^ 1] } else { self.nodes[here].rest[up] });
                here = parent;
            }
            amount = amount.min(self.nodes[here].terminal.abs());
        }
        self.nodes[node].rest[k] -= amount;
        self.nodes[other].rest[k ^ 1] += amount;
        for start in [node, other] {
            let mut here = start;
            let forwards = self.nodes[here].tree == Tree::Source;
            let signed = if forwards { amount } else { -amount };
            while let Some((parent, up)) = self.parent(here) {
                self.nodes[here].rest[up] += signed;
                self.nodes[parent].rest[up ^ 1] -= signed;
                let left = if forwards { self.nodes[parent].rest[up ^ 1] } else { self.nodes[here].rest[up] };
                if left == 0 {
                    self.orphan(here);
                }
                here = parent;
            }
            self.nodes[here].terminal -= signed;
            if self.nodes[here].terminal == 0 {
                self.orphan(here);
            }
        }
    }

    /// The parent of a node that is no root, and its direction.
    fn parent(&self, node: usize) -> Option<(usize, usize)> {
        let up = usize::from(self.nodes[node].parent);
        self.nodes[node].next.get(up).map(|&parent| (parent as usize, up))
    }

    #[inline(never)]
    fn orphan(&mut self, node: usize) {
        self.nodes[node].parent = NOBODY;
        self.orphans.push(node as u32);
    }

    /// Finds the neighbour in the same tree that is nearest to the root; without one the node is free again.
    fn adopt(&mut self, here: usize) {
        let node = self.nodes[here];
        let mut best = (u32::MAX, NOBODY);
        let related = |flow: &Self, k: usize| {
            let there = &flow.nodes[node.next[k] as usize];
            let linked = node.rest[k] > 0 || there.rest[k ^ 1] > 0;
            linked && there.tree == node.tree && there.parent != NOBODY
        };
        for k in 0..4 {
            let there = node.next[k] as usize;
            let open = if node.tree == Tree::Source { self.nodes[there].rest[k ^ 1] } else { node.rest[k] } > 0;
            if open
                && related(self, k)
                && let Some(distance) = self.distance(there)
                && distance < best.0
            {
                best = (distance, k as u8);
            }
        }
        if best.1 != NOBODY {
            let adopted = &mut self.nodes[here];
            (adopted.parent, adopted.time, adopted.distance) = (best.1, self.time, best.0 + 1);
            return;
        }
        for k in 0..4 {
            let there = node.next[k] as usize;
            if related(self, k) {
                let open = if node.tree == Tree::Source { self.nodes[there].rest[k ^ 1] } else { node.rest[k] } > 0;
                if open {
                    self.activate(there);
                }
                if usize::from(self.nodes[there].parent) == k ^ 1 {
                    self.orphan(there);
                }
            }
        }
        self.nodes[here].tree = Tree::None;
    }

    /// Steps from a node to the root of its tree; `None` below an orphan.
    #[inline(never)]
    fn distance(&mut self, start: usize) -> Option<u32> {
        let (mut here, mut steps) = (start, 0);
        let total = loop {
            let node = &self.nodes[here];
            if node.time == self.time {
                break steps + node.distance;
            }
            steps += 1;
            match node.parent {
                NOBODY => return None,
                ROOT => {
                    let node = &mut self.nodes[here];
                    (node.time, node.distance) = (self.time, 1);
                    break steps;
                }
                up => here = node.next[usize::from(up)] as usize,
            }
        };
        // What was passed is known from now on.
        let (mut here, mut steps) = (start, total);
        while self.nodes[here].time != self.time {
            let node = &mut self.nodes[here];
            (node.time, node.distance) = (self.time, steps);
            steps -= 1;
            here = node.next[usize::from(node.parent)] as usize;
        }
        Some(total)
    }
}
