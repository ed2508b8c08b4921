//! Where it is not known how to look at processes.

pub(crate) fn begin_to_look() {}

pub(crate) fn moved() -> bool {
    false
}

pub(crate) fn closed() -> bool {
    false
}

pub(super) fn forks() -> usize {
    0
}

pub(super) fn number() -> u32 {
    0
}

pub(super) fn end_copies(_: u32) {}

#[derive(Debug)]
pub(super) struct Process;

impl Process {
    pub(super) fn now() -> Self {
        Self
    }

    pub(super) fn restore(self) -> Option<String> {
        None
    }
}
