//! Any text as a model file; one that is read is written and read again as the same.
#![no_main]

use cft_ident::config::ModelFile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let Ok(model) = ModelFile::parse("m.toml", text) else {
        return;
    };
    let _ = model.model("m.toml");
    if let Ok(text) = model.to_toml() {
        let again = ModelFile::parse("m.toml", &text).expect("what is written is read");
        assert_eq!(again.parameters, model.parameters);
    }
});
