//! A log read by two passes at once: the first makes the blocks that the second reads.

use std::convert::Infallible;
use std::sync::mpsc::{SyncSender, sync_channel};

use crate::block::Block;
use crate::motion::RunError;

/// Blocks that wait between the two passes.
const WAITING: usize = 4;

/// Where the first pass puts its rows.
pub(super) struct BlockOutlet {
    block: Block,
    sender: SyncSender<Block>,
}

impl BlockOutlet {
    /// Takes a row.
    pub fn row(&mut self, write: impl FnOnce(&mut Block)) {
        write(&mut self.block);
        if self.block.len() == Block::ROWS {
            self.send();
        }
    }

    fn send(&mut self) {
        // a receiver that is gone has failed, and says so itself
        let _ = self.sender.send(std::mem::take(&mut self.block));
    }
}

/// Runs both passes; an error is that of the first, otherwise that of the second.
pub(super) fn two_passes<E: Send, A: Send, B>(
    first: impl FnOnce(&mut BlockOutlet) -> Result<A, RunError<E>> + Send,
    second: impl FnOnce(
        &mut dyn FnMut(&mut Block) -> Result<bool, Infallible>,
    ) -> Result<B, RunError<Infallible>>,
) -> Result<(A, B), RunError<E>> {
    let (sender, receiver) = sync_channel::<Block>(WAITING);
    std::thread::scope(|scope| {
        let first = scope.spawn(move || {
            let block = Block::default();
            let mut outlet = BlockOutlet { block, sender };
            // a pool of its own: a worker of the shared one may be waiting for these very blocks
            let found = match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                Ok(pool) => pool.install(|| first(&mut outlet)),
                Err(_) => first(&mut outlet),
            };
            outlet.send();
            found
        });
        let second = second(&mut |block| {
            let found = receiver.recv();
            let more = found.is_ok();
            *block = found.unwrap_or_default();
            Ok(more)
        });
        drop(receiver);
        let first = match first.join() {
            Ok(found) => found?,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        match second {
            Ok(second) => Ok((first, second)),
            Err(RunError::Motion(error)) => Err(RunError::Motion(error)),
            Err(RunError::Source(never)) => match never {},
        }
    })
}
