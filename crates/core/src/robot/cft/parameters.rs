//! Names, units and meanings of the parameters (Table 4, corrected).

use std::borrow::Cow;

use crate::robot::joint::ParameterInfo;

const fn printed(
    name: &'static str,
    theta: u32,
    unit: &'static str,
    meaning: &'static str,
) -> ParameterInfo {
    ParameterInfo {
        name: Cow::Borrowed(name),
        theta: Some(theta),
        unit: Cow::Borrowed(unit),
        meaning: Cow::Borrowed(meaning),
    }
}

const fn extra(name: &'static str, meaning: &'static str) -> ParameterInfo {
    ParameterInfo {
        name: Cow::Borrowed(name),
        theta: None,
        unit: Cow::Borrowed("kg m^2"),
        meaning: Cow::Borrowed(meaning),
    }
}

/// All 22 base parameters. m_i is the mass of link i, l_i its centre of gravity and J_i its
/// pseudo-inertia, both in the Denavit-Hartenberg frame of link i;
/// delta = (Jxx4 + Jxx6 - L4^2 (m3 + m4))/L6^2.
pub static EXTENDED: [ParameterInfo; 22] = [
    printed("theta_1", 1, "kg", "m1 + m2"),
    printed(
        "theta_2",
        2,
        "kg m",
        "m2 lx2 + m3 ly3 + m4 lz4 + m5 lz5 + m6 lz6 + m7 lz7 + m8 lz8 + d6 (m6 - theta_11)",
    ),
    printed("theta_3", 3, "kg m", "m2 ly2 + m3 lz3 + m7 ly7 + m8 lx8"),
    printed(
        "theta_4",
        4,
        "kg m^2",
        "Jxx2 + Jyy2 + Jyy3 + Jzz3 + Jzz4 + Jzz5 + Jzz6 + Jyy7 + Jzz7 + Jxx8 + Jzz8 \
         + 2 d6 m6 lz6 + d6^2 (m6 - theta_11) + 2 d (m3 lz3 + m7 ly7 + m8 lx8)",
    ),
    printed("theta_5", 5, "kg m", "m4 lx4 - L4 (m3 + m4)"),
    printed("theta_6", 6, "kg m", "m4 ly4"),
    printed("theta_7", 7, "kg m", "m6 lx6 - L6 delta"),
    printed("theta_8", 8, "kg m", "m6 ly6"),
    printed("theta_9", 9, "kg m", "m5 lx5 - L5 (m3 + m4 + m5)"),
    printed("theta_10", 10, "kg m", "m5 ly5"),
    printed("theta_11", 11, "kg", "m3 + m4 + m5 + m6 - delta"),
    printed("theta_12", 12, "kg", "m7 + m8 + delta"),
    extra("BB", "Jxx5 - L5^2 (m3 + m4 + m5)"),
    extra("EE", "Jyy5"),
    extra("CC", "Jyy4 + Jyy6"),
    extra("AC", "Jxy4 + Jxy6"),
    extra("BE", "Jxy5"),
    extra("S", "L4 m3 lz3 - L6 (m7 ly7 + m8 lx8)"),
    extra("OC", "-(Jyz4 + Jyz6)"),
    extra("OE", "-Jyz5"),
    extra(
        "OA",
        "L4 (m3 ly3 + m4 lz4) - Jxz4 - Jxz6 - L6 (m7 lz7 + m8 lz8) - d6 L6 delta",
    ),
    extra(
        "OB",
        "L4 (m3 ly3 + m4 lz4 + m5 lz5) - Jxz5 - L6 (m6 lz6 + m7 lz7 + m8 lz8) \
         + d6 L6 (m3 + m4 + m5 - delta)",
    ),
];

/// Number of them that the report's structure has: theta_1..theta_12 of Table 4.
pub const PRINTED: usize = 12;

/// Names of the ten that the report's structure lacks [kg m^2].
pub const UNPRINTED: [&str; 10] = ["BB", "EE", "CC", "AC", "BE", "S", "OC", "OE", "OA", "OB"];
