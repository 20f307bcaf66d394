//! From perfect rows to what is logged: noise, torques by (66), faults of the data, lost rows.
//!
//! Noise may be a share of a channel's own root mean square, so that it is known only when the last row is
//! there. A log that goes to its file block by block waits in a temporary file until then.

use std::io::{BufReader, BufWriter, Read, Seek, Write};

use rand_chacha::ChaCha8Rng;
use tempfile::SpooledTempFile;

use super::SimulateError;
use super::chance::{ChancePurpose, stream};
use super::effects::PlantEffects;
use super::mechanism::Mechanism;
use super::sensors::{MeanSquare, PlantSensors, disturb};
use super::simulated_run::{MotorStatus, SimulatedRun};

/// Bytes that wait in memory; what is more waits in a file of the system's temporary folder.
const IN_MEMORY: usize = 64 << 20;

/// Puts the noise, the faults and the gaps into the rows of one log, block by block.
pub(super) struct LogRecorder<'a, const J: usize> {
    sensors: &'a PlantSensors<J>,
    volts: MeanSquare<J>,
    torque: MeanSquare<J>,
    /// Chance of the volts, of the torques, of the lost rows.
    chance: [ChaCha8Rng; 3],
}

impl<'a, const J: usize> LogRecorder<'a, J> {
    pub fn new(sensors: &'a PlantSensors<J>, seed: u64) -> Self {
        let purposes = [
            ChancePurpose::Volts,
            ChancePurpose::Torque,
            ChancePurpose::Dropout,
        ];
        Self {
            sensors,
            volts: MeanSquare::new(),
            torque: MeanSquare::new(),
            chance: purposes.map(|purpose| stream(seed, purpose)),
        }
    }

    /// Takes perfect rows into the mean squares that size the noise.
    pub fn hear(&mut self, rows: &SimulatedRun<J>) {
        self.volts.add(&rows.volts);
        // The torque's own noise is sized by the torque without any.
        self.torque.add(&rows.torque);
    }

    /// Turns the next perfect rows into what is logged, when all have been heard; faults take them for a whole log.
    pub fn measure(
        &mut self,
        rows: &mut SimulatedRun<J>,
        mechanism: &Mechanism<J>,
        effects: &PlantEffects,
    ) {
        rows.volt_noise = self.sensors.volt_noise.of_rms(self.volts.root());
        rows.torque_noise = self.sensors.torque_noise.of_rms(self.torque.root());
        let [volts, torques, dropouts] = &mut self.chance;
        disturb(&mut rows.volts, &rows.volt_noise, volts);
        for ((torque, q), volts) in rows.torque.iter_mut().zip(&rows.q).zip(&rows.volts) {
            *torque = mechanism.torque(q, volts);
        }
        effects.spoil(&mut rows.joint_channels(), true);
        disturb(&mut rows.torque, &rows.torque_noise, torques);
        effects.spoil(&mut rows.joint_channels(), false);
        if self.sensors.dropouts > 0.0 {
            let kept = self.sensors.kept(rows.rows(), dropouts);
            rows.retain(&kept);
        }
    }
}

/// Perfect rows that wait, as numbers in the order t, and per joint x, volts, q, torque, speed, status.
pub(super) struct RowSpool {
    file: BufWriter<SpooledTempFile>,
    joints: usize,
    rows: u64,
}

impl RowSpool {
    pub fn new(joints: usize) -> Self {
        Self {
            file: BufWriter::new(SpooledTempFile::new(IN_MEMORY)),
            joints,
            rows: 0,
        }
    }

    pub fn push<const J: usize>(&mut self, rows: &SimulatedRun<J>) -> Result<(), SimulateError> {
        let n = self.joints;
        for k in 0..rows.rows() {
            let status = rows.status[k][..n].iter().map(|s| f64::from(s.code()));
            let parts = [&rows.x, &rows.volts, &rows.q, &rows.torque, &rows.actual.v];
            let numbers = parts
                .map(|part| &part[k][..n])
                .into_iter()
                .flatten()
                .copied();
            for number in std::iter::once(rows.t[k]).chain(numbers).chain(status) {
                self.file.write_all(&number.to_le_bytes())?;
            }
        }
        self.rows += rows.rows() as u64;
        Ok(())
    }

    /// The rows again, from the first on.
    pub fn rewind(self) -> Result<WaitedRows, SimulateError> {
        let mut file = self.file.into_inner().map_err(|error| error.into_error())?;
        file.rewind()?;
        Ok(WaitedRows {
            file: BufReader::new(file),
            joints: self.joints,
            left: self.rows,
        })
    }
}

/// Rows that have waited.
pub(super) struct WaitedRows {
    file: BufReader<SpooledTempFile>,
    joints: usize,
    left: u64,
}

impl WaitedRows {
    /// Puts the next rows, at most `most`, in place of those of `rows`; whether there were any.
    pub fn next<const J: usize>(
        &mut self,
        most: u64,
        rows: &mut SimulatedRun<J>,
    ) -> Result<bool, SimulateError> {
        rows.clear();
        let count = self.left.min(most);
        for _ in 0..count {
            rows.t.push(number(&mut self.file)?);
            let SimulatedRun {
                x,
                volts,
                q,
                torque,
                actual,
                ..
            } = &mut *rows;
            for part in [x, volts, q, torque, &mut actual.v] {
                let mut row = [0.0; J];
                for value in &mut row[..self.joints] {
                    *value = number(&mut self.file)?;
                }
                part.push(row);
            }
            let mut status = [MotorStatus::default(); J];
            for status in &mut status[..self.joints] {
                *status = MotorStatus::of_code(number(&mut self.file)?);
            }
            rows.status.push(status);
        }
        self.left -= count;
        Ok(count > 0)
    }
}

fn number(file: &mut impl Read) -> Result<f64, SimulateError> {
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes)?;
    Ok(f64::from_le_bytes(bytes))
}
