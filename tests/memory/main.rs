//! Files that lie about themselves are read or refused within bounded memory.

mod log_hostile;
mod log_protobuf;
mod memory;
