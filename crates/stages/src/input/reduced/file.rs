//! The file of reduced logs: `.cfi`.
//!
//! The first bytes say what it is, then follow as little-endian numbers the format (`u32`), the length of the head
//! and of the matrices in bytes (`u64` each); the head as deflated JSON, the matrices, and the SHA-256 of all before it
//! as 64 hexadecimal digits. One set of reduced logs gives the same bytes on every machine.

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use flate2::Compression;
use flate2::read::{DeflateDecoder, DeflateEncoder};
use serde::{Deserialize, Serialize};

use super::error::ReducedError;
use super::factors::{ReducedFactors, ReducedHead};
use super::reduced_log::{FrictionGiven, MadeWith, ReducedLog, ReducedLogs, ReducedRows};
use crate::input::log_smoothing::{CutoffCosts, LogSmoothing};
use crate::note::StageNote;
use cft_ident_core::motion::{SkippedStretches, Summary};
use cft_ident_logs::log::{Provenance, REDUCED, begins_with, escape, sha256_of_bytes};

/// Number of the format.
pub const FORMAT: u32 = 3;
/// The format before, whose head is plain JSON.
const PLAIN_HEAD: u32 = 2;
/// Bytes that a head may have, unpacked: some kilobytes a log, and of a small file no memory without end.
const MAX_HEAD: u64 = 1 << 28;
/// Hexadecimal digits of the checksum.
const CHECKSUM: usize = 64;
/// Bytes before the head.
const BEFORE: usize = REDUCED.len() + 4 + 8 + 8;

/// All but the matrices.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileHead {
    made_with: MadeWith,
    logs: Vec<LogHead>,
}

/// All but the matrices of one log.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LogHead {
    provenance: Provenance,
    bounds_s: [f64; 2],
    warnings: Vec<String>,
    summary: SummaryHead,
    rest_speed: Vec<f64>,
    cutoffs_hz: Vec<f64>,
    costs: CutoffCosts,
    fastest: Vec<f64>,
    declared: ReducedHead,
    narrower: ReducedHead,
    shifted: Vec<ReducedHead>,
}

/// [`Summary`] with what documents leave out.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SummaryHead {
    samples: u64,
    rows: u64,
    dt: f64,
    duration_s: f64,
    segments: usize,
    skipped: (usize, u64, Vec<[f64; 2]>),
    interpolated: u64,
    cutoff_hz: f64,
    decimation: usize,
    q_cutoff_hz: Option<f64>,
}

impl SummaryHead {
    fn of(s: &Summary) -> Self {
        let skipped = &s.skipped;
        SummaryHead {
            samples: s.samples,
            rows: s.rows,
            dt: s.dt,
            duration_s: s.duration_s,
            segments: s.segments,
            skipped: (skipped.segments, skipped.samples, skipped.spans_s.clone()),
            interpolated: s.interpolated,
            cutoff_hz: s.cutoff_hz,
            decimation: s.decimation,
            q_cutoff_hz: s.q_cutoff_hz,
        }
    }

    fn summary(self) -> Summary {
        let (segments, samples, spans_s) = self.skipped;
        Summary {
            samples: self.samples,
            rows: self.rows,
            dt: self.dt,
            duration_s: self.duration_s,
            segments: self.segments,
            skipped: SkippedStretches {
                segments,
                samples,
                spans_s,
            },
            interpolated: self.interpolated,
            cutoff_hz: self.cutoff_hz,
            decimation: self.decimation,
            q_cutoff_hz: self.q_cutoff_hz,
        }
    }
}

/// Whether a file says that it holds reduced logs.
pub fn is_reduced(path: &Path) -> bool {
    begins_with(path, REDUCED)
}

impl ReducedLogs {
    /// The bytes of a file.
    ///
    /// # Errors
    /// [`ReducedError::Empty`], and what JSON cannot hold.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ReducedError> {
        let made_with = self.made_with().ok_or(ReducedError::Empty)?.clone();
        let logs = self.logs().iter().map(|log| LogHead {
            provenance: log.provenance.clone(),
            bounds_s: log.bounds_s,
            warnings: log.notes.iter().map(StageNote::to_string).collect(),
            summary: SummaryHead::of(&log.summary),
            rest_speed: log.smoothing.rest_speed.clone(),
            cutoffs_hz: log.smoothing.cutoffs_hz.clone(),
            costs: log.smoothing.costs.clone(),
            fastest: log.fastest.clone(),
            declared: log.readings.declared.head().clone(),
            narrower: log.readings.narrower.head().clone(),
            shifted: log
                .readings
                .shifted
                .iter()
                .map(|s| s.head().clone())
                .collect(),
        });
        let head = FileHead {
            made_with,
            logs: logs.collect(),
        };
        let head = serde_json::to_vec(&head).map_err(|error| ReducedError::Content {
            file: "the reduced logs".to_owned(),
            problem: format!("a number cannot be written: {error}"),
        })?;
        let head = packed(&head);
        let mut matrices = Vec::new();
        for log in self.logs() {
            for factors in log.readings() {
                factors.write(&mut matrices);
            }
        }
        let mut out = Vec::with_capacity(BEFORE + head.len() + matrices.len() + CHECKSUM);
        out.extend(REDUCED);
        out.extend(FORMAT.to_le_bytes());
        out.extend((head.len() as u64).to_le_bytes());
        out.extend((matrices.len() as u64).to_le_bytes());
        out.extend(head);
        out.extend(matrices);
        let checksum = sha256_of_bytes(&out);
        out.extend(checksum.bytes());
        Ok(out)
    }

    /// Reads the bytes of a file, which `file` names in errors.
    ///
    /// # Errors
    /// [`ReducedError`] of a file that is another, of another format, cut off, or damaged.
    pub fn from_bytes(file: &str, bytes: &[u8]) -> Result<Self, ReducedError> {
        let file = || escape(file);
        let damaged = || ReducedError::Damaged { file: file() };
        if !bytes.starts_with(REDUCED) {
            return Err(ReducedError::NotReduced { file: file() });
        }
        let cut_off = |wanted: u64| ReducedError::CutOff {
            file: file(),
            found: bytes.len() as u64,
            wanted,
        };
        let before = bytes.get(REDUCED.len()..BEFORE);
        let before = before.ok_or_else(|| cut_off((BEFORE + CHECKSUM) as u64))?;
        let found = u32::from_le_bytes(before[..4].try_into().map_err(|_| damaged())?);
        if ![PLAIN_HEAD, FORMAT].contains(&found) {
            return Err(ReducedError::Format {
                file: file(),
                found,
                known: FORMAT,
            });
        }
        let length = |at: usize| -> Result<u64, ReducedError> {
            let bytes = before[at..at + 8].try_into().map_err(|_| damaged())?;
            Ok(u64::from_le_bytes(bytes))
        };
        let (head, matrices) = (length(4)?, length(12)?);
        let fixed = (BEFORE + CHECKSUM) as u64;
        let wanted = head
            .checked_add(matrices)
            .and_then(|x| x.checked_add(fixed));
        let wanted = wanted.ok_or_else(damaged)?;
        if (bytes.len() as u64) < wanted {
            return Err(cut_off(wanted));
        }
        let content = bytes.len() - CHECKSUM;
        let shown = sha256_of_bytes(&bytes[..content]);
        if bytes.len() as u64 != wanted || shown.as_bytes() != &bytes[content..] {
            return Err(damaged());
        }
        let (head, mut rest) = bytes[BEFORE..content].split_at(head as usize);
        let problem = |problem: String| ReducedError::Content {
            file: file(),
            problem,
        };
        let head = match found {
            PLAIN_HEAD => Some(head.to_vec()),
            _ => unpacked(head),
        };
        let head = head.ok_or_else(damaged)?;
        let head: FileHead = serde_json::from_slice(&head)
            .map_err(|error| problem(format!("its head cannot be read: {error}")))?;
        let n = head.made_with.joints.len();
        let whole = |f: &FrictionGiven| [f.laws.len(), f.covariances.len()] == [n, n];
        if !head.made_with.friction.iter().all(whole) {
            return Err(problem("its friction is not that of its joints".to_owned()));
        }
        let made_with = Arc::new(head.made_with);
        let logs = head.logs.into_iter();
        let logs = logs.map(|log| read_log(&made_with, log, &mut rest));
        let logs = logs.collect::<Option<Vec<_>>>();
        match (logs, rest) {
            (Some(logs), []) => ReducedLogs::merge([ReducedLogs { logs }]),
            _ => Err(problem("its matrices do not belong to its head".to_owned())),
        }
    }
}

fn packed(head: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = DeflateEncoder::new(head, Compression::best());
    // memory takes all that is written
    let _ = encoder.read_to_end(&mut out);
    out
}

/// The head as it was; none where it cannot be unpacked or is too long.
fn unpacked(head: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let mut decoder = DeflateDecoder::new(head).take(MAX_HEAD);
    decoder.read_to_end(&mut out).ok()?;
    ((out.len() as u64) < MAX_HEAD).then_some(out)
}

fn read_log(made_with: &Arc<MadeWith>, head: LogHead, rest: &mut &[u8]) -> Option<Arc<ReducedLog>> {
    let n = made_with.joints.len();
    let mut factors = |head: ReducedHead| ReducedFactors::read(head, n, rest);
    let numbers = [&head.rest_speed, &head.fastest];
    let per_joint = numbers.iter().all(|list| list.len() == n)
        && [head.costs.of_joint.len(), head.costs.known.len()] == [n, n];
    let log = ReducedLog {
        made_with: made_with.clone(),
        provenance: head.provenance,
        bounds_s: head.bounds_s,
        notes: (head.warnings.into_iter())
            .map(StageNote::OfReducedLog)
            .collect(),
        summary: head.summary.summary(),
        smoothing: LogSmoothing {
            rest_speed: head.rest_speed,
            cutoffs_hz: head.cutoffs_hz,
            costs: head.costs,
        },
        fastest: head.fastest,
        readings: ReducedRows {
            declared: factors(head.declared)?,
            narrower: factors(head.narrower)?,
            shifted: head
                .shifted
                .into_iter()
                .map(factors)
                .collect::<Option<_>>()?,
        },
    };
    (per_joint && n > 0).then(|| Arc::new(log))
}

impl ReducedLog {
    /// Every reading, in the order of the file.
    fn readings(&self) -> impl Iterator<Item = &ReducedFactors> {
        [&self.readings.declared, &self.readings.narrower]
            .into_iter()
            .chain(&self.readings.shifted)
    }
}
