//! Channels that hold the same numbers.

/// Share of the rows that must be equal.
const EQUAL_ROWS_SHARE: f64 = 0.999;
/// Rows in which a channel changes before its equality means anything.
const CHANGES: u64 = 50;

/// Counts for every pair of channels the rows in which one changed, and those of them in which they were equal.
#[derive(Debug, Clone)]
pub(crate) struct CopyDetector {
    channels: usize,
    pairs: Vec<PairCounts>,
    previous: Vec<f64>,
    row: Vec<f64>,
}

#[derive(Debug, Clone, Copy, Default)]
struct PairCounts {
    changed: u64,
    equal: u64,
    opposite: u64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CopiedChannel {
    pub(crate) first: usize,
    pub(crate) second: usize,
    /// Equal but for the sign.
    pub(crate) opposite: bool,
    pub(crate) rows: u64,
}

impl CopyDetector {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            channels,
            pairs: vec![PairCounts::default(); channels * channels.saturating_sub(1) / 2],
            previous: vec![f64::NAN; channels],
            row: vec![0.0; channels],
        }
    }

    #[inline]
    pub(crate) fn take(&mut self, columns: &[&[f64]], k: usize) {
        for (value, column) in self.row.iter_mut().zip(columns) {
            *value = column[k];
        }
        let mut pairs = self.pairs.iter_mut();
        for i in 0..self.channels {
            let (a, a_moves) = (self.row[i], self.row[i] != self.previous[i]);
            for j in i + 1..self.channels {
                let Some(pair) = pairs.next() else { return };
                let b = self.row[j];
                let moves = a_moves | (b != self.previous[j]);
                pair.changed += u64::from(moves);
                pair.equal += u64::from(moves & (a == b));
                pair.opposite += u64::from(moves & (a == -b));
            }
        }
        self.previous.copy_from_slice(&self.row);
    }

    pub(crate) fn found(&self) -> Vec<CopiedChannel> {
        let mut found = Vec::new();
        let mut pairs = self.pairs.iter();
        for first in 0..self.channels {
            for second in first + 1..self.channels {
                let Some(pair) = pairs.next() else { break };
                let most = pair.equal.max(pair.opposite);
                if pair.changed >= CHANGES && most as f64 >= EQUAL_ROWS_SHARE * pair.changed as f64
                {
                    found.push(CopiedChannel {
                        first,
                        second,
                        opposite: pair.opposite > pair.equal,
                        rows: most,
                    });
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_with_either_sign_are_found_and_channels_at_rest_are_none() {
        let a: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.01).sin()).collect();
        let b: Vec<f64> = a.iter().map(|x| -x).collect();
        let mut c = a.clone();
        c[500] += 1e-12;
        let d: Vec<f64> = a.iter().map(|x| x * 1.001).collect();
        let rest = vec![0.0; 1000];
        let columns = [&a[..], &b, &c, &d, &rest, &rest];
        let mut copies = CopyDetector::new(6);
        for k in 0..1000 {
            copies.take(&columns, k);
        }
        let found = copies.found().into_iter();
        let found: Vec<_> = found.map(|c| (c.first, c.second, c.opposite)).collect();
        assert_eq!(found, [(0, 1, true), (0, 2, false), (1, 2, true)]);
    }
}
