//! Classes of defaults of an MJCF: what an element does not say, its class says, or the class around that.

use std::collections::BTreeMap;

use cft_ident_files::config::xml::Element;

/// What stands of one class: by kind of element, then by attribute.
type ClassValues<'a> = BTreeMap<&'a str, BTreeMap<&'a str, &'a str>>;

/// All classes of a file, by name.
#[derive(Debug, Default)]
pub(super) struct ClassTable<'a> {
    classes: BTreeMap<&'a str, ClassValues<'a>>,
}

/// The outermost class.
const MAIN: &str = "main";

/// Attributes that this program asks for.
const ASKED: [&str; 16] = [
    "type",
    "axis",
    "pos",
    "ref",
    "armature",
    "damping",
    "frictionloss",
    "stiffness",
    "springref",
    "springdamper",
    "mass",
    "density",
    "springlength",
    "gear",
    "polycoef",
    "fluidshape",
];

/// Kinds of elements whose defaults are those of all actuators.
pub(super) const ACTUATORS: [&str; 11] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "pid",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
];

fn kind(name: &str) -> &str {
    match name {
        name if ACTUATORS.contains(&name) => "actuator",
        "fixed" | "spatial" => "tendon",
        name => name,
    }
}

impl<'a> ClassTable<'a> {
    /// Reads a `<default>` at the root, and the classes in it.
    pub(super) fn add(&mut self, default: Element<'a, '_>) {
        let values = self.classes.remove(MAIN).unwrap_or_default();
        self.add_class(default, MAIN, values);
    }

    fn add_class(&mut self, default: Element<'a, '_>, name: &'a str, mut values: ClassValues<'a>) {
        for of in default.children().filter(|e| e.name() != "default") {
            let known = values.entry(kind(of.name())).or_default();
            let said = ASKED
                .iter()
                .filter_map(|key| Some((*key, of.attribute(key)?)));
            known.extend(said);
        }
        for inner in default.children().filter(|e| e.name() == "default") {
            let class = inner.attribute("class").unwrap_or_default();
            self.add_class(inner, class, values.clone());
        }
        self.classes.insert(name, values);
    }

    /// An attribute of an element, `around` being the class of what it stands in.
    pub(super) fn attribute(
        &self,
        element: &Element<'a, '_>,
        key: &str,
        around: Option<&str>,
    ) -> Option<&'a str> {
        let class = element.attribute("class").or(around).unwrap_or(MAIN);
        let of_class = || {
            self.classes
                .get(class)?
                .get(kind(element.name()))?
                .get(key)
                .copied()
        };
        element.attribute(key).or_else(of_class)
    }
}
