//! Rows in which a joint rests: static friction takes any torque up to its level there, and no law of the
//! speed says which.

/// Share of movement in what the parallel filter lets through below which a row is one of rest.
const RESTING: f64 = 0.25;

/// 1 where a joint moves, 0 where it rests: a channel to filter like the torque. A `rest_speed` below 0 is of a
/// joint whose rows always count.
#[inline]
pub fn movement(v: f64, rest_speed: f64) -> f64 {
    f64::from(u8::from(v.abs() > rest_speed))
}

/// Whether a row is one of rest, from its filtered channel of [`movement`].
#[inline]
pub fn rests(filtered: f64) -> bool {
    filtered < RESTING
}
