use super::*;

#[test]
fn names_fall_into_words_at_digits_signs_and_capitals() {
    for (name, spoken) in [
        ("act_torque_abs_nm_1", "act torque abs nm 1"),
        ("JointPos2", "joint pos 2"),
        ("dQ1", "dq 1"),
        ("tau_J_d[3]", "tau j d 3"),
        (" /joint_states.q10 ", "joint states q 10"),
        ("AIPos.A1", "ai pos a 1"),
        ("tauIn_0", "tau in 0"),
        ("MsrJntTrq_A1", "msr jnt trq a 1"),
        ("tau_mNm", "tau mnm"),
        ("--", ""),
    ] {
        let found: Vec<String> = words(name).into_iter().map(|word| word.text).collect();
        assert_eq!(found.join(" "), spoken, "{name}");
    }
}

#[test]
fn a_word_for_torque_is_no_current_and_letters_of_axes_are_no_units() {
    for (name, found) in [
        ("Torque_A1", NamedDrive::Torque),
        ("A1_torque", NamedDrive::Torque),
        ("Ist-Moment A1", NamedDrive::Torque),
        ("actual_current_torque_1", NamedDrive::Torque),
        ("torque_current_1", NamedDrive::Current),
        ("MACur.A1", NamedDrive::Current),
        ("I_1", NamedDrive::Current),
        ("motor_voltage_2", NamedDrive::Voltage),
        ("force_kN", NamedDrive::Torque),
    ] {
        assert_eq!(drive(&words(name)), found, "{name}");
    }
    assert_eq!(without_units("#_pos_deg"), without_units("- #_pos_mm"));
}

#[test]
fn words_say_roles_and_commands_and_joints() {
    use ChannelRole::*;
    for (name, role_, command, joint_) in [
        ("positions_0", Some(Position), false, "0"),
        ("actual_q_0", Some(Position), false, "0"),
        ("joint_1_position", Some(Position), false, "joint_1"),
        ("act_torque_abs_nm_1", Some(Torque), false, "abs_1"),
        ("act_vel_mot_deg_per_s_3", Some(Velocity), false, "mot_3"),
        ("actual_current_2", Some(Torque), false, "2"),
        ("current_position_2", Some(Position), false, "2"),
        (
            "shoulder_pan_joint.velocity",
            Some(Velocity),
            false,
            "shoulder_pan_joint",
        ),
        ("q_dot_4", Some(Velocity), false, "4"),
        ("tau_J_d_1", Some(Torque), true, "j_d_1"),
        ("q_d_1", Some(Position), true, "d_1"),
        ("target_moment_0", Some(Torque), true, "target_0"),
        ("leader_pos_0", Some(Position), true, "leader_0"),
        ("tracking_error_1", Some(Other), false, "tracking_error_1"),
        (
            "motor_temperature_1",
            Some(Other),
            false,
            "motor_temperature_1",
        ),
        ("gripper", None, false, "gripper"),
        ("qpos_0", Some(Position), false, "0"),
        ("qfrc_actuator_0", Some(Torque), false, "0"),
        ("ctrl_torque_0", Some(Torque), true, "ctrl_0"),
        ("qIn_1", Some(Position), false, "1"),
        ("qOut_1", Some(Position), true, "1"),
        ("alphaIn_1", Some(Velocity), false, "1"),
        ("tauIn_1", Some(Torque), false, "1"),
        ("AIPos.A1", Some(Position), false, "a_1"),
        ("ASPos.A1", Some(Position), true, "as_a_1"),
        ("MACur.A1", Some(Torque), false, "a_1"),
        ("stroke_mm", Some(Position), false, ""),
    ] {
        let words = words(name);
        let found = (role(&words), is_command(&words), joint(&words));
        assert_eq!(found, (role_, command, joint_.to_owned()), "{name}");
    }
}
