use super::*;
use proptest::prelude::*;

/// A field with its bytes after their length.
fn bytes(number: u8, data: &[u8]) -> Vec<u8> {
    let mut out = vec![number << 3 | 2];
    out.extend(number_bytes(data.len() as u64));
    out.extend(data);
    out
}

fn number_bytes(mut value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    while value > 0x7f {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
    out
}

fn whole(number: u8, value: u64) -> Vec<u8> {
    [vec![number << 3], number_bytes(value)].concat()
}

fn double(number: u8, value: f64) -> Vec<u8> {
    [&[number << 3 | 1][..], &value.to_le_bytes()].concat()
}

/// A field of a type: label 1 for one, 3 for many; type as in descriptor.proto.
fn field_of(name: &str, number: u8, label: u64, kind: u64, type_name: &str) -> Vec<u8> {
    let mut out = [
        bytes(1, name.as_bytes()),
        whole(3, number.into()),
        whole(4, label),
        whole(5, kind),
    ]
    .concat();
    if !type_name.is_empty() {
        out.extend(bytes(6, type_name.as_bytes()));
    }
    bytes(2, &out)
}

fn message_of(name: &str, parts: &[Vec<u8>]) -> Vec<u8> {
    [bytes(1, name.as_bytes()), parts.concat()].concat()
}

fn set(syntax: &str) -> Vec<u8> {
    let joint = message_of(
        "Joint",
        &[
            field_of("name", 1, 1, 9, ""),
            field_of("q", 2, 1, 1, ""),
            field_of("code", 3, 1, 17, ""),
            field_of("parent", 4, 1, 11, ".lab.Arm.Joint"),
        ],
    );
    let entry = message_of(
        "GainsEntry",
        &[
            field_of("key", 1, 1, 9, ""),
            field_of("value", 2, 1, 1, ""),
            bytes(7, &whole(7, 1)),
        ],
    );
    let arm = message_of(
        "Arm",
        &[
            field_of("joints", 1, 3, 11, ".lab.Arm.Joint"),
            field_of("name", 2, 3, 9, ""),
            field_of("speeds", 3, 3, 2, ""),
            field_of("counts", 4, 3, 5, ""),
            field_of("gains", 5, 3, 11, ".lab.Arm.GainsEntry"),
            field_of("on", 6, 1, 8, ""),
            field_of("big", 7, 1, 4, ""),
            field_of("lost", 8, 1, 11, ".lab.None"),
            bytes(3, &joint),
            bytes(3, &entry),
        ],
    );
    let file = [
        bytes(1, b"arm.proto"),
        bytes(2, b"lab"),
        bytes(4, &arm),
        bytes(12, syntax.as_bytes()),
    ];
    bytes(1, &file.concat())
}

fn arm() -> Vec<u8> {
    let joint = |name: &str, q: f64| [bytes(1, name.as_bytes()), double(2, q)].concat();
    let floats = [1.5f32, -2.5].map(f32::to_le_bytes).concat();
    let gain = |key: &str, value: f64| [bytes(1, key.as_bytes()), double(2, value)].concat();
    [
        bytes(1, &[joint("a", 1.0), whole(3, 5)].concat()),
        bytes(
            1,
            &[joint("b", 2.0), bytes(4, &joint("root", 9.0))].concat(),
        ),
        bytes(2, b"left"),
        bytes(2, b"right"),
        bytes(3, &floats),
        // the third one is not packed
        [&[3 << 3 | 5][..], &7.25f32.to_le_bytes()].concat(),
        bytes(4, &[number_bytes(-3i64 as u64), number_bytes(300)].concat()),
        whole(4, 12),
        bytes(5, &gain("p", 4.0)),
        bytes(5, &gain("d", 0.5)),
        whole(7, 1),
        // the last one counts
        whole(7, u64::MAX),
    ]
    .concat()
}

fn value(syntax: &str, data: &[u8], path: &str) -> Result<Value, String> {
    let mut reader = ProtoReader::new("lab.Arm", &set(syntax), &FieldPath::each(&[path])).unwrap();
    let mut out = [Value::Absent];
    reader.read(data, &mut out)?;
    Ok(out[0])
}

#[test]
fn paths_lead_to_numbers_in_messages_arrays_and_maps() {
    for (path, expected) in [
        ("joints[1].q", Value::Float(2.0)),
        ("/joints/0/code", Value::Int(-3)),
        ("joints[name=b].q", Value::Float(2.0)),
        ("joints[name=b].parent.q", Value::Float(9.0)),
        ("speeds[0]", Value::Float(1.5)),
        ("speeds[2]", Value::Float(7.25)),
        ("counts[0]", Value::Int(-3)),
        ("/counts/1", Value::Int(300)),
        ("counts[2]", Value::Int(12)),
        ("gains.d", Value::Float(0.5)),
        ("/gains/p", Value::Float(4.0)),
        ("big", Value::Unsigned(u64::MAX)),
    ] {
        assert_eq!(value("proto3", &arm(), path), Ok(expected), "{path}");
    }
    // three speeds of two names: whose they are is not known
    let to_none = "speeds[name=right] joints joints[2].q joints[name=c].q joints[0] joints[0].name name[0] speeds[3] \
        counts[3] gains.i gains none lost.q big.q speeds[name=up] joints[0].parent.q joints[0].q[0]";
    for path in to_none.split_whitespace() {
        assert_eq!(value("proto3", &arm(), path), Ok(Value::Absent), "{path}");
    }
}

#[test]
fn a_number_that_is_left_out_is_0_where_the_language_says_so() {
    let joint = bytes(1, &bytes(1, b"a"));
    for (syntax, data, path, expected) in [
        ("proto3", &[][..], "on", Value::Int(0)),
        ("proto3", &[], "big", Value::Int(0)),
        ("proto2", &[], "on", Value::Absent),
        ("proto2", &[], "big", Value::Absent),
        ("proto3", &joint, "joints[name=a].q", Value::Float(0.0)),
        ("proto3", &joint, "joints[name=a].parent.q", Value::Absent),
    ] {
        assert_eq!(value(syntax, data, path), Ok(expected), "{syntax} {path}");
    }
}

#[test]
fn broken_messages_and_sets_without_the_type_are_refused() {
    let cut = &arm()[..arm().len() - 1];
    assert!(value("proto3", cut, "big").unwrap_err().contains("cut off"));
    let set = set("proto3");
    let missing = ProtoReader::new("lab.Leg", &set, &[]).unwrap_err();
    assert!(missing.contains("does not define lab.Leg"), "{missing}");
    let damaged = ProtoReader::new("lab.Arm", &set[..50], &[]).unwrap_err();
    assert!(damaged.contains("damaged"), "{damaged}");
}

proptest! {
    #[test]
    fn no_set_and_no_message_makes_the_reader_panic(
        changes in prop::collection::vec((any::<u16>(), any::<u8>()), 0..9),
        data in prop_oneof![Just(arm()), prop::collection::vec(any::<u8>(), 0..80)],
        path in "(joints|name|speeds|counts|gains|big)(\\[[0-9]\\]|\\[name=[ab]\\])?(\\.(q|parent|p)){0,2}",
    ) {
        let mut set = set("proto3");
        for (at, byte) in changes {
            let length = set.len();
            set[usize::from(at) % length] = byte;
        }
        if let Ok(mut reader) = ProtoReader::new("lab.Arm", &set, &FieldPath::each(&[&path])) {
            let _ = reader.read(&data, &mut [Value::Absent]);
            reader.names(&data);
        }
    }
}
