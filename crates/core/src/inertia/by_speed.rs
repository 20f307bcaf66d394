//! Sums of a joint's rows by its direction and speed.

use nalgebra::DVector;

use super::columns::{JointTerm, RegressorColumns};

/// How speeds are parted.
struct Limits {
    /// Upper end of the first class, over the speed up to which the joint rests (a hundredth of its rms speed).
    first: f64,
    /// Classes in each octave of speed; half or twice as many change no share of the coverage study.
    per_octave: f64,
    /// Classes of each direction.
    classes: usize,
}

const LIMITS: Limits = Limits {
    first: 12.5,
    per_octave: 2.0,
    classes: 12,
};

/// Products of a joint's rows with its Coulomb column, by direction and class of speed; empty where its friction is not
/// viscous and Coulomb.
#[derive(Debug, Clone, Default)]
pub struct BySpeed {
    classes: Vec<SpeedClass>,
}

/// Sums of the Coulomb column over the rows of one class of speed.
#[derive(Debug, Clone, Default)]
pub(super) struct SpeedClass {
    /// Of the Coulomb column with itself.
    pub square: f64,
    /// Of the Coulomb column with the unknowns' columns and the target.
    pub product: Vec<f64>,
}

impl BySpeed {
    /// Adds a row of joint j.
    pub(super) fn add(&mut self, columns: &RegressorColumns, j: usize, row: &[f64]) {
        let Some(place) = SpeedColumns::of(columns, j) else {
            return;
        };
        let (speed, level) = (row[place.viscous], row[place.coulomb]);
        let octaves = (speed.abs() / (LIMITS.first * place.rest_speed)).log2();
        let class = ((1.0 + LIMITS.per_octave * octaves).max(0.0) as usize).min(LIMITS.classes - 1);
        let side = usize::from(level < 0.0) * LIMITS.classes;
        self.classes
            .resize_with(2 * LIMITS.classes, SpeedClass::default);
        let class = &mut self.classes[side + class];
        class.square += level * level;
        class.product.resize(row.len(), 0.0);
        let sums = class.product.iter_mut().zip(row);
        sums.for_each(|(sum, x)| *sum += level * x);
    }

    pub(super) fn merge(&mut self, other: &BySpeed) {
        let most = self.classes.len().max(other.classes.len());
        self.classes.resize_with(most, SpeedClass::default);
        for (own, other) in self.classes.iter_mut().zip(&other.classes) {
            own.square += other.square;
            let most = own.product.len().max(other.product.len());
            own.product.resize(most, 0.0);
            let sums = own.product.iter_mut().zip(&other.product);
            sums.for_each(|(a, b)| *a += b);
        }
    }

    /// The classes that hold rows.
    pub(super) fn filled(&self) -> impl Iterator<Item = &SpeedClass> {
        self.classes.iter().filter(|class| class.square > 0.0)
    }

    /// Mean squares of the residual's level in the classes, beyond what noise of this variance of a row makes of it.
    pub(super) fn departure(&self, theta: &DVector<f64>, noise: f64) -> FrictionDeparture {
        let level = |class: &SpeedClass| {
            let each = class.product.iter().zip(theta.iter());
            let fitted: f64 = each.map(|(x, p)| x * p).sum();
            (class.product.last().copied().unwrap_or(0.0) - fitted) / class.square
        };
        let (mut level_sum, mut rows, mut squares) = (0.0, 0.0, 0.0);
        for class in self.filled() {
            squares += class.square * class.square;
            level_sum += level(class).powi(2) * class.square - noise;
            rows += class.square;
        }
        // a constant torque is a level of either sign in the two directions
        let (forward, backward) = self.classes.split_at(self.classes.len() / 2);
        let (mut constant_sum, mut paired) = (0.0, 0.0);
        for (a, b) in forward.iter().zip(backward) {
            if a.square > 0.0 && b.square > 0.0 {
                let by_noise = noise * (1.0 / a.square + 1.0 / b.square);
                let square = (level(a) - level(b)).powi(2) - by_noise;
                constant_sum += (a.square + b.square) * square / 4.0;
                paired += a.square + b.square;
            }
        }
        let mean = |sum: f64, rows: f64| match rows > 0.0 {
            true => (sum / rows).max(0.0),
            false => 0.0,
        };
        let classes = rows * rows / squares;
        FrictionDeparture {
            level: mean(level_sum, rows),
            constant: mean(constant_sum, paired),
            classes: if rows > 0.0 { classes } else { 1.0 },
        }
    }
}

/// How far friction departs from its law over the speed, as mean squares \[N^2 or (Nm)^2\].
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionDeparture {
    /// Of the torque against the motion.
    pub level: f64,
    /// Of what is the same in both directions.
    pub constant: f64,
    /// Classes that it is of: as many of one size as would scatter alike.
    pub classes: f64,
}

/// Where a joint's speed and its Coulomb term stand in its row.
pub(super) struct SpeedColumns {
    pub viscous: usize,
    pub coulomb: usize,
    rest_speed: f64,
}

impl SpeedColumns {
    pub(super) fn of(columns: &RegressorColumns, j: usize) -> Option<SpeedColumns> {
        let place = |wanted: JointTerm| {
            let place = columns.own[j].iter().position(|own| *own == wanted)?;
            Some(columns.shared + place)
        };
        Some(SpeedColumns {
            viscous: place(JointTerm::Viscous)?,
            coulomb: place(JointTerm::Coulomb)?,
            rest_speed: *columns.rest_speed.get(j).filter(|speed| **speed > 0.0)?,
        })
    }
}
