use super::*;
use proptest::prelude::*;

/// Writes CDR by its rules, independently of the reader.
struct Writer {
    bytes: Vec<u8>,
    big: bool,
    align: usize,
}

impl Writer {
    fn new(kind: u8) -> Self {
        Self {
            bytes: vec![0, kind, 0, 0],
            big: kind & 1 == 0,
            align: if kind < 2 { 8 } else { 4 },
        }
    }

    fn put(&mut self, little: &[u8]) {
        let size = little.len().min(self.align);
        while !(self.bytes.len() - 4).is_multiple_of(size) {
            self.bytes.push(0xee);
        }
        let mut bytes = little.to_vec();
        if self.big {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    fn text(&mut self, text: &str) {
        self.put(&(text.len() as u32 + 1).to_le_bytes());
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.put(&(numbers.len() as u32).to_le_bytes());
        for number in numbers {
            self.put(&number.to_le_bytes());
        }
    }
}

#[derive(Debug, Clone)]
struct State {
    stamp: (i32, u32),
    frame: String,
    joints: Vec<(String, f64, f64)>,
}

fn states() -> impl Strategy<Value = State> {
    let joints = prop::collection::btree_map("[a-z]{1,9}", (any::<f64>(), any::<f64>()), 0..6);
    let joints = joints.prop_map(|joints| {
        let joints = joints.into_iter().map(|(name, (q, tau))| (name, q, tau));
        joints.collect::<Vec<_>>()
    });
    let parts = (any::<(i32, u32)>(), "\\PC{0,9}", joints.prop_shuffle());
    parts.prop_map(|(stamp, frame, joints)| State {
        stamp,
        frame,
        joints,
    })
}

fn written(state: &State, kind: u8) -> Vec<u8> {
    let mut out = Writer::new(kind);
    out.put(&state.stamp.0.to_le_bytes());
    out.put(&state.stamp.1.to_le_bytes());
    out.text(&state.frame);
    out.put(&(state.joints.len() as u32).to_le_bytes());
    for (name, _, _) in &state.joints {
        out.text(name);
    }
    out.numbers(&state.joints.iter().map(|joint| joint.1).collect::<Vec<_>>());
    out.numbers(&[]);
    out.numbers(&state.joints.iter().map(|joint| joint.2).collect::<Vec<_>>());
    out.bytes
}

fn reader(paths: &[&str]) -> CdrReader {
    CdrReader::parse("sensor_msgs/msg/JointState", "", paths).unwrap()
}

#[test]
fn paths_that_lead_to_no_number_are_absent() {
    let state = State {
        stamp: (1, 2),
        frame: "world".to_owned(),
        joints: vec![("a".to_owned(), 1.0, 2.0)],
    };
    for (paths, leads) in [
        (
            &[
                "header.stamp.sec",
                "position[0]",
                "/effort/0",
                "position[name=a]",
            ][..],
            true,
        ),
        (
            &[
                "position",
                "name[0]",
                "header",
                "header.frame_id",
                "position[frame=a]",
            ],
            false,
        ),
        (&["header.stamp.sec[0]", "none"], false),
    ] {
        let values = reader(paths).values(&written(&state, 1)).unwrap();
        for (path, value) in paths.iter().zip(values) {
            assert_eq!(value != Value::Absent, leads, "{path}");
        }
    }
}

#[test]
fn arrays_of_messages_are_read_by_index_past_fields_of_changing_size() {
    let text = "Drive[] drives\nint8 last\n===\nMSG: p/Drive\nstring[] notes\nint16 code\nfloat64[2] pair\nbool on\n";
    let paths = [
        "drives[1].pair[1]",
        "drives[0].code",
        "drives[1].on",
        "last",
        "drives[2].code",
    ];
    let mut reader = CdrReader::parse("p/msg/Drives", text, &paths).unwrap();
    let mut out = Writer::new(1);
    out.put(&2u32.to_le_bytes());
    for (notes, code, pair) in [
        (&["x"][..], -7i16, [1.0, 2.0f64]),
        (&["", "yz"], 9, [3.0, 4.0]),
    ] {
        out.put(&(notes.len() as u32).to_le_bytes());
        for note in notes {
            out.text(note);
        }
        out.put(&code.to_le_bytes());
        for number in pair {
            out.put(&number.to_le_bytes());
        }
        out.put(&[1]);
    }
    out.put(&[0xff]);
    let numbers = [
        Value::Float(4.0),
        Value::Int(-7),
        Value::Int(1),
        Value::Int(-1),
    ];
    let expected = [&numbers[..], &[Value::Absent]].concat();
    assert_eq!(reader.values(&out.bytes), Ok(expected));
}

#[test]
fn packed_messages_of_the_first_ros_are_read_without_padding() {
    let text = "Header header\nfloat64[] position\n===\nMSG: std_msgs/Header\nuint32 seq\nuint8 odd\ntime stamp\n";
    let messages = msg::parse("p/M", text).unwrap();
    let fields = FieldPath::each(&["header.stamp.nsecs", "position[1]"]);
    let mut reader = CdrReader::new(messages, Encoding::Ros1, &fields);
    let mut bytes = vec![1, 0, 0, 0, 5];
    bytes.extend([3u32, 250].map(u32::to_le_bytes).concat());
    bytes.extend(2u32.to_le_bytes());
    bytes.extend([7.0f64, 8.0].map(f64::to_le_bytes).concat());
    let expected = vec![Value::Int(250), Value::Float(8.0)];
    assert_eq!(reader.values(&bytes), Ok(expected));
}

#[test]
fn other_encodings_and_short_messages_are_refused() {
    let long = [&[0, 1, 0, 0][..], &[0; 12], &[0xff; 4], &[0; 8]].concat();
    for (data, word) in [
        (&[0, 3, 0, 0, 1][..], "0x0003"),
        (&[0, 1], "ends after 2 bytes"),
        (&[0, 1, 0, 0, 1, 2], "inside a field"),
        (&long, "4294967295 elements"),
    ] {
        let refused = reader(&["position[0]"]).values(data).unwrap_err();
        assert!(refused.contains(word), "{refused}");
    }
}

proptest! {
    #[test]
    fn any_joint_state_is_read_in_both_byte_orders_and_both_versions(
        states in prop::collection::vec(states(), 1..4),
        kind in prop::sample::select(vec![0u8, 1, 6, 7]),
        wanted in "[a-z]{1,2}",
    ) {
        let named = states[0].joints.first().map_or(wanted, |joint| joint.0.clone());
        let paths = [
            "header.stamp.sec".to_owned(),
            "header.stamp.nanosec".to_owned(),
            format!("position[name={named}]"),
            format!("effort[name={named}]"),
            "velocity[0]".to_owned(),
            "position[1]".to_owned(),
        ];
        let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
        let mut reader = reader(&paths);
        for state in &states {
            let out = reader.values(&written(state, kind)).unwrap();
            let joint = state.joints.iter().find(|joint| joint.0 == named);
            let float = |number: Option<f64>| number.map_or(Value::Absent, Value::Float);
            let bits = |value: Value| value.number().map(f64::to_bits);
            prop_assert_eq!(out[0], Value::Int(state.stamp.0.into()));
            prop_assert_eq!(out[1], Value::Int(state.stamp.1.into()));
            prop_assert_eq!(bits(out[2]), bits(float(joint.map(|j| j.1))));
            prop_assert_eq!(bits(out[3]), bits(float(joint.map(|j| j.2))));
            prop_assert_eq!(out[4], Value::Absent);
            prop_assert_eq!(bits(out[5]), bits(float(state.joints.get(1).map(|j| j.1))));
        }
    }

    #[test]
    fn no_bytes_and_no_definition_make_the_decoder_panic(
        text in prop_oneof![
            "(((float64|string|uint8|A|B)(\\[\\]|\\[[0-9]{1,9}\\])? [ab]|===|MSG: p/[AB])\n){0,9}",
            "\\PC{0,60}",
        ],
        path in "[ab](\\[[0-9]\\]|\\[[ab]=[ab]\\])?(\\.[ab](\\[[0-9]\\])?){0,2}",
        data in prop::collection::vec(any::<u8>(), 0..80),
        kind in prop::sample::select(vec![0u8, 1, 7]),
    ) {
        let Ok(messages) = msg::parse("p/R", &text) else {
            return Ok(());
        };
        let message = [&[0, kind, 0, 0][..], &data].concat();
        for encoding in [Encoding::Cdr, Encoding::Ros1] {
            let mut reader = CdrReader::new(messages.clone(), encoding, &FieldPath::each(&[&path]));
            let _ = reader.values(&message);
            reader.names(&message);
        }
    }
}
