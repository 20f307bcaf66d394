//! Any bytes as a message of any definition, asked for any field: definition, path and message
//! with a byte 255 between them, which no text holds.
#![no_main]

use cft_ident::log::CdrReader;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut parts = data.splitn(3, |byte| *byte == 0xff);
    let (Some(text), Some(path), Some(message)) = (parts.next(), parts.next(), parts.next())
    else {
        return;
    };
    let (Ok(text), Ok(path)) = (std::str::from_utf8(text), std::str::from_utf8(path)) else {
        return;
    };
    for name in ["sensor_msgs/msg/JointState", "p/R"] {
        if let Ok(mut reader) = CdrReader::parse(name, text, &[path, "position[name=a]"]) {
            let _ = reader.values(message);
        }
    }
});
