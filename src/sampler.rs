//! Random numbers, the same on every platform.

/// PCG32 (O'Neill 2014, XSH-RR 64/32).
#[derive(Debug, Clone)]
pub(crate) struct Sampler {
    state: u64,
}

impl Sampler {
    const MULTIPLIER: u64 = 6364136223846793005;
    const INCREMENT: u64 = 1442695040888963407;

    pub fn new(seed: u32) -> Self {
        let mut sampler = Self { state: u64::from(seed).wrapping_add(Self::INCREMENT) };
        sampler.next();
        sampler
    }

    fn next(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(Self::MULTIPLIER).wrapping_add(Self::INCREMENT);
        ((((old >> 18) ^ old) >> 27) as u32).rotate_right((old >> 59) as u32)
    }

    /// A number below `n`. The bias of the multiply-shift method is below n/2³², which is negligible here.
    #[inline]
    pub fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.next()) * n as u64) >> 32) as usize
    }

    /// Fills `picked` with distinct indices below `n`, which must be at least `picked.len()`.
    pub fn sample(&mut self, n: usize, picked: &mut [usize]) {
        for i in 0..picked.len() {
            picked[i] = loop {
                let index = self.below(n);
                if !picked[..i].contains(&index) {
                    break index;
                }
            };
        }
    }
}
