//! What the search is judged on: laws, the machines and joints that have them, and clean machines.

use crate::machine::Kind;
use crate::uncatalogued::Uncatalogued;

/// A law, the machine and joint that have it, and its signals; none on a clean machine.
#[derive(Clone, Copy)]
pub struct Subject {
    pub name: &'static str,
    pub(super) kind: Kind,
    pub(super) joint: usize,
    pub(super) law: Option<Uncatalogued>,
    /// What a formula is in, and what it may be in besides.
    pub(super) signals: &'static [&'static str],
    pub(super) besides: &'static [&'static str],
    /// By one who had not seen the search: counted apart.
    pub(super) reviewed: bool,
}

/// The laws, ten by ten, clean machines, then the ten of a reviewer who had not seen the search.
pub fn subjects() -> Vec<Subject> {
    use Uncatalogued::*;
    let of = |name, (kind, joint), law, signals, besides| Subject {
        name,
        kind,
        joint,
        law: Some(law),
        signals,
        besides,
        reviewed: false,
    };
    let reviewed = |name, at, law, signals, besides| Subject {
        reviewed: true,
        ..of(name, at, law, signals, besides)
    };
    let one = (Kind::Single, 0);
    let far = (Kind::Arm3, 2);
    let shoulder = (Kind::Arm3, 1);
    let clean = |kind| Subject {
        name: "nothing",
        kind,
        joint: 0,
        law: None,
        signals: &[],
        besides: &[],
        reviewed: false,
    };
    let other = 1;
    vec![
        of(
            "speed times speed",
            far,
            SpeedProduct { other },
            &["v", "v_o"],
            &[],
        ),
        of(
            "friction by another position",
            far,
            FrictionByOther { other },
            &["v", "q_o"],
            &[],
        ),
        of("hose", far, Hose { other }, &["q", "q_o"], &[]),
        of("cam", one, Cam, &["q"], &[]),
        of(
            "cogging by load",
            shoulder,
            LoadCogging,
            &["load", "q"],
            &[],
        ),
        of("Maxwell slip", one, MaxwellSlip, &["memory"], &["v"]),
        of(
            "thermal friction",
            one,
            ThermalFriction,
            &["v", "warm"],
            &[],
        ),
        of(
            "magnetic hysteresis",
            one,
            MagneticHysteresis,
            &["memory", "q"],
            &["v"],
        ),
        of(
            "friction after a reversal",
            one,
            DwellFriction,
            &["memory"],
            &["v"],
        ),
        of(
            "drag by pose",
            far,
            DragByPose { other },
            &["v", "q_o"],
            &[],
        ),
        of(
            "seal by speed",
            far,
            SealBySpeed { other },
            &["v", "v_o"],
            &[],
        ),
        of(
            "eccentric load",
            shoulder,
            EccentricLoad,
            &["v", "load", "q"],
            &[],
        ),
        of(
            "spring between joints",
            far,
            SpringBetween { other },
            &["q", "q_o"],
            &[],
        ),
        of("cable", far, Cable { other }, &["q", "q_o"], &[]),
        of("film loss", one, FilmLoss, &["v"], &[]),
        of(
            "thermal viscosity",
            one,
            ThermalViscosity,
            &["v", "warm"],
            &[],
        ),
        of("eddy poles", one, EddyPoles, &["v", "q"], &[]),
        of(
            "friction by acceleration",
            one,
            FrictionByAcceleration,
            &["v", "a"],
            &[],
        ),
        of(
            "inertia by position",
            one,
            InertiaByPosition,
            &["a", "q"],
            &[],
        ),
        of(
            "hysteresis by load",
            shoulder,
            LoadedHysteresis,
            &["memory", "load"],
            &["v"],
        ),
        of(
            "wheel spun by another joint",
            far,
            SpunWheel { other },
            &["v_o", "q"],
            &[],
        ),
        of(
            "friction off a pose",
            far,
            FrictionOffPose { other },
            &["v", "q_o"],
            &[],
        ),
        of("taut hose", far, TautHose { other }, &["q", "q_o"], &[]),
        of("cam lobe", one, CamLobe, &["q"], &[]),
        of(
            "cogging by load size",
            shoulder,
            CoggingByLoadSize,
            &["load", "q"],
            &[],
        ),
        of("uneven slip", one, UnevenSlip, &["memory"], &["v"]),
        of("warm spring", one, WarmSpring, &["warm", "q"], &[]),
        of(
            "hysteresis by pole",
            one,
            PoleHysteresis,
            &["memory", "q"],
            &["v"],
        ),
        of("creep friction", one, CreepFriction, &["v"], &[]),
        of(
            "belt between joints",
            far,
            BeltBetween { other },
            &["q", "q_o"],
            &[],
        ),
        clean(Kind::Single),
        clean(Kind::Arm3),
        reviewed("thrown body", far, ThrownBody { other }, &["v_o", "q"], &[]),
        reviewed(
            "saturating motor",
            shoulder,
            SaturatingMotor,
            &["load"],
            &[],
        ),
        reviewed("worn spot", one, WornSpot, &["v", "q"], &[]),
        reviewed("crank damper", one, CrankDamper, &["v", "q"], &[]),
        reviewed("warm cogging", one, WarmCogging, &["warm", "q"], &[]),
        reviewed(
            "warm hysteresis",
            one,
            WarmHysteresis,
            &["memory", "warm"],
            &["v"],
        ),
        reviewed("energy chain", far, EnergyChain, &["v", "q"], &[]),
        reviewed(
            "differential's teeth",
            far,
            DifferentialTeeth { other },
            &["q", "q_o"],
            &[],
        ),
        reviewed("fan", far, Fan { other }, &["v", "v_o"], &[]),
        reviewed("churning", one, Churning, &["v"], &[]),
    ]
}
