//! A pickle read as data: a dictionary of tensors as `torch.save` writes it, and nothing else.
//!
//! No code of the file is run. Three globals are known by name (`torch._utils._rebuild_tensor_v2`, the storages of
//! floating numbers, `collections.OrderedDict`); anything else in the file is an error that names it.

use std::collections::HashMap;

/// A tensor: where its numbers lie.
#[derive(Debug, Clone, PartialEq)]
pub struct TensorPlace {
    /// Member of the archive under `data/`.
    pub storage: String,
    /// Bytes of a number.
    pub bytes: usize,
    pub offset: usize,
    pub shape: Vec<usize>,
    pub stride: Vec<usize>,
}

/// What stands on the stack.
#[derive(Debug, Clone, PartialEq)]
enum PickleItem {
    Mark,
    None,
    Bool,
    Int(i64),
    Text(String),
    Tuple(Vec<PickleItem>),
    Dict(Vec<(PickleItem, PickleItem)>),
    Global(PickleGlobal),
    Storage {
        key: String,
        bytes: usize,
    },
    Tensor(TensorPlace),
    /// An ordered dictionary of hooks: empty.
    Hooks,
}

/// Globals that are known.
#[derive(Debug, Clone, Copy, PartialEq)]
enum PickleGlobal {
    Rebuild,
    Floats(usize),
    Ordered,
}

/// Most items on the stack and in the memo.
const MOST: usize = 100_000;

/// Tensors by their key. `Err` says what the file holds that is none.
pub fn tensors(bytes: &[u8]) -> Result<Vec<(String, TensorPlace)>, String> {
    let mut machine = Machine {
        bytes,
        at: 0,
        stack: Vec::new(),
        memo: HashMap::new(),
    };
    match machine.run()? {
        PickleItem::Dict(pairs) => {
            let tensor = |(key, value)| match (key, value) {
                (PickleItem::Text(key), PickleItem::Tensor(tensor)) => Ok((key, tensor)),
                (PickleItem::Text(key), _) => Err(format!("`{key}` is no tensor")),
                _ => Err("a key is no text".to_owned()),
            };
            pairs.into_iter().map(tensor).collect()
        }
        _ => Err("its outermost value is no dictionary".to_owned()),
    }
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<PickleItem>,
    memo: HashMap<u32, PickleItem>,
}

impl<'a> Machine<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(count);
        let found = end.and_then(|end| self.bytes.get(self.at..end));
        self.at += count;
        found.ok_or_else(|| "it is cut off".to_owned())
    }

    fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    fn number(&mut self, count: usize) -> Result<u32, String> {
        let bytes = self.take(count)?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |sum, byte| sum << 8 | u32::from(*byte)))
    }

    fn line(&mut self) -> Result<String, String> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let end = rest
            .iter()
            .position(|b| *b == b'\n')
            .ok_or("it is cut off")?;
        let line = String::from_utf8_lossy(self.take(end)?).into_owned();
        self.at += 1;
        Ok(line)
    }

    fn pop(&mut self) -> Result<PickleItem, String> {
        self.stack
            .pop()
            .ok_or_else(|| "its stack is empty".to_owned())
    }

    fn push(&mut self, item: PickleItem) -> Result<(), String> {
        if self.stack.len() > MOST {
            return Err("it holds too much".to_owned());
        }
        self.stack.push(item);
        Ok(())
    }

    /// Items above the last mark.
    fn take_to_mark(&mut self) -> Result<Vec<PickleItem>, String> {
        let mark = self
            .stack
            .iter()
            .rposition(|item| *item == PickleItem::Mark);
        let mark = mark.ok_or("a mark is missing")?;
        let items = self.stack.split_off(mark + 1);
        self.stack.pop();
        Ok(items)
    }

    fn put(&mut self, key: u32) -> Result<(), String> {
        if self.memo.len() > MOST {
            return Err("it holds too much".to_owned());
        }
        let item = self.stack.last().cloned().ok_or("its stack is empty")?;
        self.memo.insert(key, item);
        Ok(())
    }

    fn get(&mut self, key: u32) -> Result<(), String> {
        let item = self
            .memo
            .get(&key)
            .cloned()
            .ok_or("it names what it does not hold")?;
        self.push(item)
    }

    fn run(&mut self) -> Result<PickleItem, String> {
        loop {
            let code = self.byte()?;
            match code {
                0x80 => {
                    let protocol = self.byte()?;
                    if protocol > 2 {
                        return Err(format!("pickle protocol {protocol}, and 2 is read"));
                    }
                }
                b'}' => self.push(PickleItem::Dict(Vec::new()))?,
                b'(' => self.push(PickleItem::Mark)?,
                b')' => self.push(PickleItem::Tuple(Vec::new()))?,
                b'N' => self.push(PickleItem::None)?,
                0x88 | 0x89 => self.push(PickleItem::Bool)?,
                b'q' => {
                    let key = self.number(1)?;
                    self.put(key)?;
                }
                b'r' => {
                    let key = self.number(4)?;
                    self.put(key)?;
                }
                b'h' => {
                    let key = self.number(1)?;
                    self.get(key)?;
                }
                b'j' => {
                    let key = self.number(4)?;
                    self.get(key)?;
                }
                b'X' => {
                    let length = self.number(4)? as usize;
                    let text = String::from_utf8_lossy(self.take(length)?).into_owned();
                    self.push(PickleItem::Text(text))?;
                }
                b'K' => {
                    let x = i64::from(self.number(1)?);
                    self.push(PickleItem::Int(x))?;
                }
                b'M' => {
                    let x = i64::from(self.number(2)?);
                    self.push(PickleItem::Int(x))?;
                }
                b'J' => {
                    let x = i64::from(self.number(4)? as i32);
                    self.push(PickleItem::Int(x))?;
                }
                b't' => {
                    let items = self.take_to_mark()?;
                    self.push(PickleItem::Tuple(items))?;
                }
                0x85..=0x87 => {
                    let count = usize::from(code - 0x84);
                    let from = self
                        .stack
                        .len()
                        .checked_sub(count)
                        .ok_or("its stack is empty")?;
                    let items = self.stack.split_off(from);
                    self.push(PickleItem::Tuple(items))?;
                }
                b'c' => {
                    let (module, name) = (self.line()?, self.line()?);
                    self.push(PickleItem::Global(known(&module, &name)?))?;
                }
                b'Q' => {
                    let storage = storage(self.pop()?)?;
                    self.push(storage)?;
                }
                b'R' => {
                    let (arguments, callable) = (self.pop()?, self.pop()?);
                    self.push(made(callable, arguments)?)?;
                }
                b'u' => {
                    let items = self.take_to_mark()?;
                    let Some(PickleItem::Dict(pairs)) = self.stack.last_mut() else {
                        return Err("items are set in what is no dictionary".to_owned());
                    };
                    let mut items = items.into_iter();
                    while let (Some(key), Some(value)) = (items.next(), items.next()) {
                        pairs.push((key, value));
                    }
                }
                b's' => {
                    let (value, key) = (self.pop()?, self.pop()?);
                    match self.stack.last_mut() {
                        Some(PickleItem::Dict(pairs)) => pairs.push((key, value)),
                        _ => return Err("an item is set in what is no dictionary".to_owned()),
                    }
                }
                b'.' => return self.pop(),
                other => return Err(format!("it holds the instruction 0x{other:02x}")),
            }
        }
    }
}

fn known(module: &str, name: &str) -> Result<PickleGlobal, String> {
    match (module, name) {
        ("torch._utils", "_rebuild_tensor_v2") => Ok(PickleGlobal::Rebuild),
        ("torch", "FloatStorage") => Ok(PickleGlobal::Floats(4)),
        ("torch", "DoubleStorage") => Ok(PickleGlobal::Floats(8)),
        ("collections", "OrderedDict") => Ok(PickleGlobal::Ordered),
        _ => Err(format!("it asks for `{module}.{name}`, which is not read")),
    }
}

/// The storage that ('storage', type, key, device, count) names.
fn storage(item: PickleItem) -> Result<PickleItem, String> {
    let PickleItem::Tuple(items) = item else {
        return Err("a storage is not named as torch does".to_owned());
    };
    match items.as_slice() {
        [
            PickleItem::Text(word),
            PickleItem::Global(PickleGlobal::Floats(bytes)),
            PickleItem::Text(key),
            ..,
        ] if word == "storage" => Ok(PickleItem::Storage {
            key: key.clone(),
            bytes: *bytes,
        }),
        _ => Err("a storage holds no floating numbers".to_owned()),
    }
}

fn sizes(item: &PickleItem) -> Result<Vec<usize>, String> {
    let PickleItem::Tuple(items) = item else {
        return Err("a shape is no tuple".to_owned());
    };
    let size = |item: &PickleItem| match item {
        PickleItem::Int(x) => usize::try_from(*x).map_err(|_| "a size is below 0".to_owned()),
        _ => Err("a size is no number".to_owned()),
    };
    items.iter().map(size).collect()
}

/// What a known global makes of arguments.
fn made(callable: PickleItem, arguments: PickleItem) -> Result<PickleItem, String> {
    let PickleItem::Tuple(arguments) = arguments else {
        return Err("arguments are no tuple".to_owned());
    };
    match (callable, arguments.as_slice()) {
        (PickleItem::Global(PickleGlobal::Ordered), []) => Ok(PickleItem::Hooks),
        (
            PickleItem::Global(PickleGlobal::Rebuild),
            [
                PickleItem::Storage { key, bytes },
                PickleItem::Int(offset),
                shape,
                stride,
                ..,
            ],
        ) => Ok(PickleItem::Tensor(TensorPlace {
            storage: key.clone(),
            bytes: *bytes,
            offset: usize::try_from(*offset).map_err(|_| "an offset is below 0")?,
            shape: sizes(shape)?,
            stride: sizes(stride)?,
        })),
        _ => Err("it calls what is not read".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_run_code_is_refused_by_name() {
        // pickle.dumps(os.system, 0) called with a text
        let evil = b"cposix\nsystem\nX\x02\x00\x00\x00ls\x85R.";
        let error = tensors(evil).unwrap_err();
        assert!(error.contains("posix.system"), "{error}");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good = b"\x80\x02}q\x00(X\x01\x00\x00\x00ack\n)R\x85Qu.".to_vec();
        for k in 0..good.len() {
            let mut bytes = good.clone();
            for byte in [0, 0x28, 0x2e, 0x52, 0x74, 0x75, 0x86, 0xff] {
                bytes[k] = byte;
                let _ = tensors(&bytes);
                let _ = tensors(&bytes[..k]);
            }
        }
        assert_eq!(
            tensors(b"N."),
            Err("its outermost value is no dictionary".to_owned())
        );
    }
}
