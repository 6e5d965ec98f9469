//! A check of the order of collective calls: ranks that call different methods of a body would wait for each other
//! for ever, or take each other's messages. In builds with debug assertions, and where the variable [`CHECK`] is set,
//! each call is compared before it begins.

use crate::parallel::World;
use crate::{Error, Result};
use std::cell::Cell;
use std::sync::OnceLock;

/// Environment variable that turns the check on.
pub const CHECK: &str = "RAILSQUEAL_CHECK_COLLECTIVES";

/// The collective calls of one body so far.
#[derive(Debug)]
pub struct CollectiveOrderCheck {
    body: String,
    /// Hash of all calls, in their order.
    calls: Cell<u64>,
}

fn checked() -> bool {
    static ON: OnceLock<bool> = OnceLock::new();
    *ON.get_or_init(|| cfg!(debug_assertions) || std::env::var_os(CHECK).is_some())
}

/// FNV-1a, kept to 52 bits: the sum of a few of them is exact in a double.
fn hash(start: u64, text: &str) -> u64 {
    let mixed =
        text.bytes().fold(start ^ 0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
    mixed >> 12
}

impl CollectiveOrderCheck {
    /// No call of `body` yet.
    pub fn new(body: &str) -> Self {
        Self { body: body.into(), calls: Cell::new(0) }
    }

    /// Collective, where the check is on: notes that `call` begins. An error on every rank if they do not all begin
    /// the same call after the same calls.
    pub fn enter(&self, world: &World, call: &'static str) -> Result<()> {
        if !checked() {
            return Ok(());
        }
        let mine = hash(hash(self.calls.get(), &self.body), call);
        self.calls.set(mine);
        let (highest, lowest) = (world.max(mine as f64), -world.max(-(mine as f64)));
        if highest == lowest {
            return Ok(());
        }
        Err(Error::Defect(format!(
            "collective calls out of step: rank {} is in `{call}` of body \"{}\", others are not, or came there \
             another way",
            world.rank, self.body
        )))
    }
}
