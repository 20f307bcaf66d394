//! `backlash-impact`: play between the motor, whose encoder is logged, and a load that is not held by friction. Where
//! the torque that the load asks for changes its sign, the load flies: the motor feels nothing of it until the gap
//! `gap` is crossed, and then takes up at once the speed that it has gained on it (a plastic impact, Nordin and
//! Gutman 2002). Play behind which friction holds the load still is `backlash`.
//!
//! With z the load's position over the motor's, d2z/dt2 = -tau_l/M_jj in flight; `inertia` d2z/dt2 is added, and at the
//! contact what takes dz/dt away within a sample.

use super::elasticity::inertia;
use super::{
    Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, ShapeSpan, SpeedLadder, Unit,
    exact,
};
use crate::robot::JointKind;

pub static ENTRY: Entry = Entry {
    name: "backlash-impact",
    families: &[Family::Memory],
    keys: &[
        Key::shape("gap", Unit::Position).above_zero("must be above 0"),
        Key::size("inertia", Unit::Inertia)
            .above_zero("must be above 0, and below the joint's least"),
    ],
    search: ShapeSearch::Refined,
    must: &[
        Rule::at_most(
            LimitedNumber::Key("gap"),
            Limit::Backlash,
            "the play of a gear is at most 0.03 rad or 2 mm, of a harmonic or direct drive none, or what \
             [drive] declares",
        ),
        Rule::not_negative("inertia", "a body behind a play has mass"),
    ],
    ladder: Some(SpeedLadder::NARROW),
    separate_by: "hold the motor still and turn the load by hand from end to end of the play; log positions on both sides",
    formula: "inertia d2z/dt2 of a load of that inertia behind a play of width gap, z its position over the motor's: \
              it flies while it is not pushed, and takes the motor's speed where it lands",
    source: "a coupling, a key or a gear that is loose between motor and load (Nordin and Gutman 2002)",
    at_rest: true,
    said: |f| {
        format!(
            "play of {} between motor and load, {} wide, with a load of {}",
            f.at,
            f.size("gap"),
            f.size("inertia")
        )
    },
    remedy: "check coupling, key and gear between motor and load for play; log positions on the load's side",
    measurable: true,
    ..Entry::USUAL
};

/// Widths to begin with over the most that a drive without a declaration has.
const WIDTHS: [f64; 12] = [
    0.08, 0.12, 0.17, 0.23, 0.3, 0.37, 0.45, 0.53, 0.61, 0.7, 0.8, 0.92,
];

pub static LAW: Law = Law {
    shape: &["gap"],
    starts: |cover, place| {
        cover.reversing(place, 4, "fewer than four reversals")?;
        let most = match cover.kinds[place.joint().unwrap_or(0)] {
            JointKind::Revolute => 0.03,
            JointKind::Prismatic => 2e-3,
        };
        Ok(WIDTHS.map(|share| vec![share * most]).to_vec())
    },
    limits: |cover, place, _| {
        let range = cover.at(place).range();
        vec![ShapeSpan::of(1e-4 * range, 0.3 * range)]
    },
    // where it lands jumps from sample to sample
    slope_step: 0.03,
    // inertia; side on which the motor pushes; position and speed of the load over the motor's; whether it flies
    memory: Some(5),
    code: Some(|to| {
        let (q, load) = (to.q(), to.load());
        let own = to.remember("loose", Some(OF_CODE), "0.0", &q);
        let half = exact(0.5 * to.shape[0]);
        to.step(format!("{} * $loose({half}, dt, {load}, &{own})", to.x(0)));
        to.elastic();
    }),
    ..Law::linear(&ENTRY, &["inertia"], |at, kept, out| {
        let (half, dt) = (0.5 * at.shape[0], at.scene.stretch.dt);
        let begins = kept[0].is_nan();
        if begins {
            kept[0] = inertia(at.scene, at.joint);
        }
        let &mut [inertia, ref mut state @ ..] = kept else {
            return;
        };
        if inertia <= 0.0 {
            return;
        }
        let pull = at.load() / inertia;
        if begins {
            let side = if pull < 0.0 { -1.0 } else { 1.0 };
            state.copy_from_slice(&[side, -side * half, 0.0, 0.0]);
        }
        let [side, z, rate, flies] = state else {
            return;
        };
        if *flies == 0.0 && *side * pull < 0.0 {
            (*rate, *flies) = (0.0, 1.0);
        }
        if *flies == 1.0 {
            *rate -= pull * dt;
            *z += *rate * dt;
            out[0] = -pull;
            if z.abs() >= half {
                *side = if *z > 0.0 { -1.0 } else { 1.0 };
                out[0] -= *rate / dt;
                (*z, *rate, *flies) = (-*side * half, 0.0, 0.0);
            }
        }
    })
};

/// State in generated code: side, position and speed over the motor's, 1 in contact and 2 in flight; the inertia in the
/// place that elastic joints have it.
const OF_CODE: usize = 10;
