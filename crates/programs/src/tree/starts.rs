//! Where the tokens of a file start, in little more than two bytes each.
//!
//! Starts ascend, so only their lower halves are stored one by one. The upper half is the number of multiples of 65,536 that the
//! tokens so far have passed: a list has the token that passes each, and a table says for each block of tokens where in the
//! list to look.

use rayon::prelude::*;

/// Tokens of a block. In a file of short tokens hardly a block passes more than one multiple.
const BLOCK: usize = 1 << 10;

/// Tokens that one thread copies at once.
const AT_ONCE: usize = 1 << 16;

/// The starts of tokens in ascending order.
#[derive(Debug, Clone, Default)]
pub struct Starts {
    low: Vec<u16>,
    /// For each multiple of 65,536 but 0: the first token that starts there or later.
    passed: Vec<u32>,
    /// For each block that begins before the last of these tokens: how many multiples its first token has passed.
    blocks: Vec<u16>,
}

impl Starts {
    /// No starts, but room for so many.
    pub fn with_capacity(tokens: usize) -> Self {
        Starts { low: Vec::with_capacity(tokens), ..Starts::default() }
    }

    /// Appends the start of the next token.
    #[inline]
    pub fn push(&mut self, start: u32) {
        let high = (start >> 16) as usize;
        if high > self.passed.len() {
            self.pass(high, self.low.len());
        }
        self.low.push(start as u16);
    }

    /// Appends the starts of the next tokens.
    #[inline]
    pub fn extend(&mut self, starts: &[u32]) {
        match starts.last() {
            Some(&last) if (last >> 16) as usize > self.passed.len() => {
                starts.iter().for_each(|&start| self.push(start));
            }
            _ => self.low.extend(starts.iter().map(|&start| start as u16)),
        }
    }

    /// Appends the starts of a later part of the same file.
    pub fn append(&mut self, part: &Self) {
        let tokens = self.low.len();
        for (multiple, &token) in part.passed.iter().enumerate().skip(self.passed.len()) {
            self.pass(multiple + 1, tokens + token as usize);
        }
        self.low.par_extend(part.low.par_iter().with_min_len(AT_ONCE).copied());
    }

    /// Records that a token is the first after so many multiples.
    #[cold]
    fn pass(&mut self, multiples: usize, token: usize) {
        self.blocks.resize(token.div_ceil(BLOCK), self.passed.len() as u16);
        self.passed.resize(multiples, token as u32);
    }

    /// Where a token starts; `None` past the last.
    #[inline]
    pub fn get(&self, token: u32) -> Option<u32> {
        let low = *self.low.get(token as usize)?;
        Some(self.high(token) << 16 | u32::from(low))
    }

    /// Where two tokens start. Cheaper than one by one where the second follows soon, as the end of a token or node does.
    #[inline]
    pub fn pair(&self, first: u32, second: u32) -> (Option<u32>, Option<u32>) {
        let Some(&low) = self.low.get(first as usize) else { return (None, self.get(second)) };
        let high = self.high(first);
        let near = second.wrapping_sub(first) < BLOCK as u32;
        let start = |&low: &u16| {
            let high = if near { self.high_from(high, second) } else { self.high(second) };
            high << 16 | u32::from(low)
        };
        (Some(high << 16 | u32::from(low)), self.low.get(second as usize).map(start))
    }

    /// How many multiples have been passed up to a token.
    #[inline]
    fn high(&self, token: u32) -> u32 {
        let block = self.blocks.get(token as usize / BLOCK);
        self.high_from(block.map_or(self.passed.len() as u32, |&passed| passed.into()), token)
    }

    /// The same from the number at an earlier token.
    #[inline]
    fn high_from(&self, mut high: u32, token: u32) -> u32 {
        while self.passed.get(high as usize).is_some_and(|&first| first <= token) {
            high += 1;
        }
        high
    }
}
