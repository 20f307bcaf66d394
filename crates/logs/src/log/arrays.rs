//! A log that is in memory: times, positions and torques as arrays.

use std::sync::Arc;

use super::layout::Layout;
use super::rows::LogRows;
use super::source::SourceChecksum;
use super::temperatures::JointTemperatures;
use super::time::RowTime;
use super::{Block, LogError};
use cft_ident_core::number::{beyond, is_usable};

/// Times, joint positions and joint torques of one log, in SI units, row after row.
#[derive(Debug, Clone, PartialEq)]
pub struct LogArrays {
    name: String,
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
    /// The positions that the controller was asked for, as a log of their own.
    references: Option<Arc<LogArrays>>,
    /// Temperatures of joints [degC], each with one value per row.
    temperatures: Vec<(usize, Vec<f64>)>,
    sha256: String,
}

impl LogArrays {
    /// Rows of a log: `t` [s], `q` [m or rad] and `tau` [N or Nm] with one value per joint and row;
    /// `tau` may be empty. Whether the numbers can be used is seen as they are read.
    ///
    /// # Errors
    /// Numbers of values that do not belong together.
    pub fn new(name: &str, t: Vec<f64>, q: Vec<f64>, tau: Vec<f64>) -> Result<Self, LogError> {
        let of = (name, t.len());
        if q.len().checked_rem(t.len()) != Some(0) || q.is_empty() {
            return Err(shape(of, "q", q.len(), POSITIONS));
        }
        if !tau.is_empty() && tau.len() != q.len() {
            return Err(shape(of, "tau", tau.len(), TORQUES));
        }
        let mut checksum = SourceChecksum::default();
        for value in t.iter().chain(&q).chain(&tau) {
            checksum.update(&value.to_le_bytes());
        }
        Ok(Self {
            name: name.to_owned(),
            t,
            q,
            tau,
            references: None,
            temperatures: Vec::new(),
            sha256: checksum.hexadecimal(),
        })
    }

    /// The same with the positions that the controller was asked for.
    ///
    /// # Errors
    /// Another number of values than there are positions.
    pub fn with_references(mut self, references: Vec<f64>) -> Result<Self, LogError> {
        if references.len() != self.q.len() {
            return Err(shape(
                (&self.name, self.t.len()),
                "the reference",
                references.len(),
                "give one reference beside every position",
            ));
        }
        let of = Self::new(&self.name, self.t.clone(), references, Vec::new())?;
        self.references = Some(Arc::new(of));
        Ok(self)
    }

    /// The same with the temperature of a joint [degC], one value per row.
    ///
    /// # Errors
    /// Another number of values than there are rows, and one that is no number.
    pub fn with_temperature(
        mut self,
        joint: usize,
        temperatures: Vec<f64>,
    ) -> Result<Self, LogError> {
        let channel = "the temperature";
        if temperatures.len() != self.t.len() {
            let (of, values) = ((&*self.name, self.t.len()), temperatures.len());
            return Err(shape(of, channel, values, "give one temperature per row"));
        }
        if let Some(row) = temperatures.iter().position(|x| !is_usable(*x)) {
            let value = temperatures[row];
            return Err(LogError::NotFinite {
                at: format!("{}, row {}", self.name, row + 1),
                column: channel.to_owned(),
                text: format!("{value:?}{}", beyond(value)),
                remedy: "give the last temperature before it again, or leave the rows out",
            });
        }
        self.temperatures.retain(|(j, _)| *j != joint);
        self.temperatures.push((joint, temperatures));
        Ok(self)
    }

    /// The temperatures that were given.
    pub fn temperatures(&self) -> JointTemperatures {
        let columns = self.temperatures.iter();
        JointTemperatures::of_columns(&self.t, columns.map(|(j, x)| (*j, x.as_slice())))
    }

    /// The same log with the torques of each joint times a factor of its own.
    ///
    /// # Errors
    /// Another number of factors than there are joints.
    pub fn with_torques_times(&self, factors: &[f64]) -> Result<Self, LogError> {
        let tau = self.tau.chunks(factors.len().max(1));
        let tau = tau.flat_map(|row| row.iter().zip(factors).map(|(tau, factor)| tau * factor));
        let of = Self::new(&self.name, self.t.clone(), self.q.clone(), tau.collect())?;
        Ok(Self {
            references: self.references.clone(),
            temperatures: self.temperatures.clone(),
            ..of
        })
    }

    /// Name of the log.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// SHA-256 of times, positions and torques as little-endian bytes, hexadecimal.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The references as the positions of a log without torques.
    pub fn references(&self) -> Option<&Arc<LogArrays>> {
        self.references.as_ref()
    }
}

/// What to do about numbers of values that do not belong together.
const POSITIONS: &str = "give one position per joint and row";
const TORQUES: &str = "give one torque beside every position";

fn shape(
    (log, rows): (&str, usize),
    channel: &'static str,
    values: usize,
    remedy: &'static str,
) -> LogError {
    LogError::Shape {
        log: log.to_owned(),
        channel,
        values,
        rows,
        remedy,
    }
}

pub(super) struct ArrayRows {
    arrays: Arc<LogArrays>,
    /// Names of the positions, then of the torques that are read.
    names: Vec<String>,
    joints: usize,
    /// Rows that were begun.
    row: usize,
}

impl ArrayRows {
    pub(super) fn open(arrays: &Arc<LogArrays>, layout: &Layout) -> Result<Self, LogError> {
        let joints = layout.positions.len();
        let (of, values) = ((arrays.name(), arrays.t.len()), arrays.q.len());
        if values != joints * arrays.t.len() {
            return Err(shape(of, "q", values, POSITIONS));
        }
        if arrays.tau.is_empty() && !layout.torques.is_empty() {
            return Err(shape(of, "tau", 0, TORQUES));
        }
        let channels = layout.positions.iter().chain(&layout.torques);
        Ok(Self {
            arrays: Arc::clone(arrays),
            names: channels.map(|channel| channel.column.clone()).collect(),
            joints,
            row: 0,
        })
    }

    /// The numbers of the current row, in the order of the names.
    fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let here = (self.row - 1) * self.joints..self.row * self.joints;
        let tau = self.arrays.tau.get(here.clone()).unwrap_or_default();
        let all = self.arrays.q[here].iter().chain(tau);
        all.copied().take(self.names.len())
    }

    fn not_finite(&self, column: &str, value: f64) -> LogError {
        LogError::NotFinite {
            at: self.place(),
            column: column.to_owned(),
            text: format!("{value:?}{}", beyond(value)),
            remedy: "leave such rows out: a step without rows is taken as a gap",
        }
    }
}

impl LogRows for ArrayRows {
    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        let Some(t) = self.arrays.t.get(self.row).copied() else {
            return Ok(None);
        };
        self.row += 1;
        match is_usable(t) {
            true => Ok(Some(RowTime::Seconds(t))),
            false => Err(self.not_finite("t", t)),
        }
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        for ((column, name), value) in self.names.iter().enumerate().zip(self.values()) {
            if !is_usable(value) {
                return Err(self.not_finite(name, value));
            }
            match column < self.joints {
                true => block.q.push(value),
                false => block.tau.push(value),
            }
        }
        Ok(())
    }

    fn repeats(&self) -> bool {
        let Some(before) = self.row.checked_sub(2) else {
            return false;
        };
        let LogArrays { t, q, tau, .. } = &*self.arrays;
        let mut parts = [(t, 1), (q, self.joints), (tau, self.joints)].into_iter();
        parts.all(|(x, n)| {
            x.get(before * n..(before + 1) * n) == x.get((before + 1) * n..(before + 2) * n)
        })
    }

    fn number(&self) -> u64 {
        self.row as u64
    }

    fn place(&self) -> String {
        format!("{}, row {}", self.arrays.name, self.row)
    }

    fn is_recording(&self) -> bool {
        false
    }

    fn sha256(&self) -> Option<&str> {
        Some(&self.arrays.sha256)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Reader;
    use super::*;

    fn read(t: &[f64], q: &[f64], tau: &[f64]) -> Result<Block, LogError> {
        let arrays = LogArrays::new("arm", t.to_vec(), q.to_vec(), tau.to_vec())?;
        let layout = Layout::joint_columns(&["q1", "q2"]);
        let mut reader = Reader::of_arrays(&Arc::new(arrays), layout)?;
        let mut block = Block::default();
        reader.read(&mut block)?;
        Ok(block)
    }

    #[test]
    fn arrays_are_read_as_a_file_is() {
        let (q, tau) = ([1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]);
        let block = read(&[0.0, 0.1], &q, &tau).unwrap();
        assert_eq!([block.t, block.q, block.tau], [&[0.0, 0.1][..], &q, &tau]);
        assert_eq!(block.line0, 1);
    }

    #[test]
    fn what_a_file_is_refused_for_arrays_are_too() {
        let (q, tau) = ([1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]);
        let (t, one_nan) = ([0.0, 0.1], [1.0, f64::NAN, 3.0, 4.0]);
        for (t, q, tau, said) in [
            (
                [0.1, 0.0],
                &q[..],
                &tau[..],
                "arm, row 2: time runs backwards",
            ),
            (t, &one_nan, &tau, "arm, row 1: column `q_q2` holds NaN"),
            (t, &q, &[0.0; 4], "arm: torque column `tau_q1` is 0"),
            (t, &q, &tau[..2], "arm: tau holds 2 values for 2 rows"),
            (t, &q[..2], &[], "arm: q holds 2 values"),
        ] {
            let text = read(&t, q, tau).unwrap_err().to_string();
            assert!(text.starts_with(said), "{text}");
        }
    }
}
