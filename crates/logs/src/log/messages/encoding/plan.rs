//! Which numbers are taken from the messages of one type: field paths resolved against its definition.

use super::msg::{ElementCount, ElementType, Field, PrimitiveType};
use crate::log::messages::path::PathStep;

#[derive(Debug, Clone, Default)]
pub(super) struct MessagePlan {
    pub(super) root: PlanNode,
    pub(super) picks: Vec<ElementPick>,
    /// Type of the elements of each array that is remembered.
    pub(super) arrays: Vec<PrimitiveType>,
    /// Number of lists of names that are remembered.
    pub(super) lists: usize,
}

/// What is taken from a message: its fields in order, those of no interest left out.
#[derive(Debug, Clone, Default)]
pub(super) struct PlanNode {
    pub(super) slots: Vec<(usize, PlanSlot)>,
}

/// What is taken from a field, and to which outputs it goes.
#[derive(Debug, Clone)]
pub(super) enum PlanSlot {
    /// A number for this output.
    Number(Vec<usize>),
    /// An array of numbers, remembered under this index.
    Array(usize),
    /// A list of texts, remembered under this index.
    List(usize),
    Inner(PlanNode),
    /// Some elements of an array of messages.
    Elements(Vec<(usize, PlanNode)>),
}

/// An element of an array for one output.
#[derive(Debug, Clone)]
pub(super) struct ElementPick {
    pub(super) output: usize,
    pub(super) array: usize,
    pub(super) by: ElementSelector,
}

/// Which element of an array is meant: by its index, or by its name in a list beside it.
#[derive(Debug, Clone)]
pub(super) enum ElementSelector {
    Index(usize),
    Name {
        list: usize,
        name: String,
        /// Where it stood in the message before: most likely there again.
        last: usize,
    },
}

/// A step on the way to a number: into a field, or into an element of an array of messages.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PathHop {
    Field(usize),
    Element(usize),
}

/// Where the way to a number ends.
enum PathEnd {
    Number,
    Element(usize, PrimitiveType),
    /// An element by its name: the route to the list of names.
    Named(Vec<PathHop>, String, PrimitiveType),
}

impl MessagePlan {
    /// Adds the number at the end of a path to the plan; false where the path leads to none.
    pub(super) fn add(
        &mut self,
        messages: &[Vec<Field>],
        steps: &[PathStep],
        output: usize,
    ) -> bool {
        let Some((hops, end)) = route(messages, steps) else {
            return false;
        };
        let (by, kind) = match end {
            PathEnd::Number => {
                let slot = slot(&mut self.root, &hops, || PlanSlot::Number(Vec::new()));
                if let PlanSlot::Number(outputs) = slot {
                    outputs.push(output);
                }
                return true;
            }
            PathEnd::Element(index, kind) => (ElementSelector::Index(index), kind),
            PathEnd::Named(list, name, kind) => {
                let next = self.lists;
                let PlanSlot::List(list) = slot(&mut self.root, &list, || PlanSlot::List(next))
                else {
                    return true;
                };
                let (list, last) = (*list, 0);
                self.lists += usize::from(list == next);
                (ElementSelector::Name { list, name, last }, kind)
            }
        };
        let next = self.arrays.len();
        if let PlanSlot::Array(array) = slot(&mut self.root, &hops, || PlanSlot::Array(next)) {
            let array = *array;
            if array == next {
                self.arrays.push(kind);
            }
            self.picks.push(ElementPick { output, array, by });
        }
        true
    }
}

fn route(messages: &[Vec<Field>], steps: &[PathStep]) -> Option<(Vec<PathHop>, PathEnd)> {
    let mut hops = Vec::new();
    let mut inside = 0;
    let mut steps = steps.iter().peekable();
    // Messages on the way, with the hops that lead to them: where lists of names are looked for.
    let mut outer = vec![(0, 0)];
    loop {
        let PathStep::Field(name) = steps.next()? else {
            return None;
        };
        let (index, field) = find_field(&messages[inside], name)?;
        hops.push(PathHop::Field(index));
        let selector = match field.count {
            ElementCount::One => None,
            ElementCount::Fixed(_) | ElementCount::Sequence => Some(steps.next()?),
        };
        let number = match selector {
            None => None,
            Some(PathStep::Index(index)) => Some(*index),
            Some(PathStep::Field(digits)) => Some(digits.parse().ok()?),
            Some(PathStep::Named { list, value }) => {
                let ElementType::Primitive(kind) = field.kind else {
                    return None;
                };
                let list = outer.iter().rev().find_map(|(message, depth)| {
                    let (index, field) = find_field(&messages[*message], list)?;
                    let texts =
                        field.kind == ElementType::String && field.count != ElementCount::One;
                    texts.then(|| [&hops[..*depth], &[PathHop::Field(index)]].concat())
                })?;
                let end = PathEnd::Named(list, value.clone(), kind);
                return steps.next().is_none().then_some((hops, end));
            }
        };
        match field.kind {
            ElementType::String | ElementType::WideString => return None,
            ElementType::Primitive(kind) => {
                let end = match number {
                    None => PathEnd::Number,
                    Some(number) => PathEnd::Element(number, kind),
                };
                return steps.next().is_none().then_some((hops, end));
            }
            ElementType::Message(message) => {
                hops.extend(number.map(PathHop::Element));
                inside = message;
                outer.push((message, hops.len()));
            }
        }
    }
}

fn find_field<'f>(fields: &'f [Field], name: &str) -> Option<(usize, &'f Field)> {
    fields.iter().enumerate().find(|(_, f)| f.name == name)
}

/// The slot at the end of some hops, made where there is none.
fn slot<'n>(
    node: &'n mut PlanNode,
    hops: &[PathHop],
    new: impl FnOnce() -> PlanSlot,
) -> &'n mut PlanSlot {
    let [PathHop::Field(field), rest @ ..] = hops else {
        // hops begin with a field, and an element is followed by one
        return node.entry(0, new);
    };
    match rest {
        [] => node.entry(*field, new),
        [PathHop::Element(element), rest @ ..] => {
            let elements = match node.entry(*field, || PlanSlot::Elements(Vec::new())) {
                PlanSlot::Elements(elements) => elements,
                other => return other,
            };
            let at = elements.partition_point(|(index, _)| index < element);
            if elements.get(at).is_none_or(|(index, _)| index != element) {
                elements.insert(at, (*element, PlanNode::default()));
            }
            slot(&mut elements[at].1, rest, new)
        }
        rest => match node.entry(*field, || PlanSlot::Inner(PlanNode::default())) {
            PlanSlot::Inner(inner) => slot(inner, rest, new),
            other => other,
        },
    }
}

impl PlanNode {
    fn entry(&mut self, field: usize, new: impl FnOnce() -> PlanSlot) -> &mut PlanSlot {
        let at = self.slots.partition_point(|(index, _)| *index < field);
        if self.slots.get(at).is_none_or(|(index, _)| *index != field) {
            self.slots.insert(at, (field, new()));
        }
        &mut self.slots[at].1
    }
}
