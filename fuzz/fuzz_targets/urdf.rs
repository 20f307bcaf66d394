//! Any text as a URDF, and the robot that it makes.
#![no_main]

use cft_ident::config::UrdfChain;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(chain) = UrdfChain::parse("r.urdf", text, None) {
        assert!(!chain.links.is_empty(), "a chain moves");
        let _ = UrdfChain::parse("r.urdf", text, chain.links[0].name.as_deref());
    }
});
