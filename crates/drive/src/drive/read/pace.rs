//! A log as PACE (legged robots, Isaac Lab) writes it: `time`, `dof_pos` and `des_dof_pos`, a `.pt` of `torch.save`.
//!
//! The file is a zip of members that are stored as they are: a pickle with the tensors' places, and their numbers.

use super::pickle::{TensorPlace, tensors};

/// The columns of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct PaceLog {
    pub t: Vec<f64>,
    /// Joint after joint.
    pub position: Vec<Vec<f64>>,
    pub command: Vec<Vec<f64>>,
}

/// Reads the bytes of a file. `Err` says what is wrong.
pub fn read(bytes: &[u8]) -> Result<PaceLog, String> {
    let members = members(bytes)?;
    let find = |end: &str| {
        let mut all = members.iter();
        all.find(|m| m.name.ends_with(end))
            .ok_or_else(|| format!("the archive holds no {end}"))
    };
    let pickle = find("/data.pkl")?;
    if let Ok(order) = find("/byteorder")
        && order.bytes.trim_ascii() != b"little"
    {
        let order = String::from_utf8_lossy(order.bytes).into_owned();
        return Err(format!(
            "its numbers are in {order} byte order, and little is read"
        ));
    }
    let tensors =
        tensors(pickle.bytes).map_err(|what| format!("its pickle is not read: {what}"))?;
    let tensor = |name: &str| -> Result<Vec<Vec<f64>>, String> {
        let names = || {
            tensors
                .iter()
                .map(|(name, _)| name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        let mut all = tensors.iter();
        let place = all.find(|(key, _)| key == name);
        let (_, place) = place.ok_or_else(|| format!("holds no `{name}`, but {}", names()))?;
        let data = find(&format!("/data/{}", place.storage))?;
        columns(place, data.bytes).map_err(|what| format!("`{name}`: {what}"))
    };
    let t = tensor("time")?.swap_remove(0);
    let log = PaceLog {
        position: tensor("dof_pos")?,
        command: tensor("des_dof_pos")?,
        t,
    };
    let rows = log.t.len();
    let even = |columns: &[Vec<f64>]| columns.iter().all(|c| c.len() == rows);
    if !even(&log.position) || !even(&log.command) || log.position.len() != log.command.len() {
        return Err(
            "time, dof_pos and des_dof_pos differ in length or in number of joints".to_owned(),
        );
    }
    Ok(log)
}

/// The columns of a tensor of one or two dimensions.
fn columns(place: &TensorPlace, bytes: &[u8]) -> Result<Vec<Vec<f64>>, String> {
    let (rows, wide, strides) = match (place.shape.as_slice(), place.stride.as_slice()) {
        ([rows], [a]) => (*rows, 1, [*a, 0]),
        ([rows, wide], [a, b]) => (*rows, *wide, [*a, *b]),
        (shape, _) => {
            return Err(format!(
                "has {} dimensions, and 1 or 2 are read",
                shape.len()
            ));
        }
    };
    if rows == 0 || wide == 0 || wide > MOST_JOINTS {
        return Err(format!("{rows} rows of {wide} numbers"));
    }
    let number = |r: usize, c: usize| -> Result<f64, String> {
        let sum = r.checked_mul(strides[0]).zip(c.checked_mul(strides[1]));
        let at = sum.and_then(|(a, b)| a.checked_add(b)?.checked_add(place.offset));
        let from = at.and_then(|at| at.checked_mul(place.bytes));
        let found = from.and_then(|from| bytes.get(from..from.checked_add(place.bytes)?));
        let found = found.ok_or("its numbers are cut off")?;
        let x = match found {
            [a, b, c, d] => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            found => f64::from_le_bytes(found.try_into().map_err(|_| "odd numbers")?),
        };
        match x.is_finite() {
            true => Ok(x),
            false => Err(format!("row {r}: is no number")),
        }
    };
    (0..wide)
        .map(|c| (0..rows).map(|r| number(r, c)).collect())
        .collect()
}

/// Most joints of a log.
const MOST_JOINTS: usize = 256;

/// A member of a zip archive.
struct PaceMember<'a> {
    name: String,
    bytes: &'a [u8],
}

fn number(bytes: &[u8], at: usize, count: usize) -> Result<usize, String> {
    let found = bytes.get(at..at + count).ok_or("the archive is cut off")?;
    Ok(found
        .iter()
        .rev()
        .fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
}

/// Members that are stored as they are, by the directory at the end.
fn members(bytes: &[u8]) -> Result<Vec<PaceMember<'_>>, String> {
    let end = bytes.windows(4).rposition(|four| four == b"PK\x05\x06");
    let end = end.ok_or("is no archive as torch.save writes it")?;
    let mut at = number(bytes, end + 16, 4)?;
    let mut out = Vec::new();
    while bytes.get(at..at + 4) == Some(b"PK\x01\x02") {
        let [packed, size, name, extra, comment] =
            [(10, 2), (24, 4), (28, 2), (30, 2), (32, 2)].map(|(k, n)| number(bytes, at + k, n));
        let (name, extra, comment) = (name?, extra?, comment?);
        if packed? != 0 {
            return Err("its members are packed, and stored ones are read".to_owned());
        }
        let text = bytes
            .get(at + 46..at + 46 + name)
            .ok_or("the archive is cut off")?;
        let header = number(bytes, at + 42, 4)?;
        let from = header + 30 + number(bytes, header + 26, 2)? + number(bytes, header + 28, 2)?;
        let size = size?;
        let body = bytes
            .get(from..from + size)
            .ok_or("the archive is cut off")?;
        out.push(PaceMember {
            name: String::from_utf8_lossy(text).into_owned(),
            bytes: body,
        });
        at += 46 + name + extra + comment;
    }
    Ok(out)
}
