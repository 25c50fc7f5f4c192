//! Draws for this room's tests: the same each time, named by what they are for.

use crate::ids::Digest;

pub struct Draws {
    purpose: &'static str,
    count: u64,
}

impl Draws {
    pub fn new(purpose: &'static str) -> Draws {
        Draws { purpose, count: 0 }
    }

    pub fn next_u64(&mut self) -> u64 {
        self.count += 1;
        let digest = Digest::of(format!("{} {}", self.purpose, self.count).as_bytes());
        u64::from_be_bytes(*digest.0.first_chunk().unwrap())
    }

    /// Below `limit`, which is at least 1.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.next_u64() % limit as u64) as usize
    }

    pub fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.next_u64() as u8).collect()
    }
}
