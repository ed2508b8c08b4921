//! Nothing unwinds across the boundary: panics and failures become a status and a message.
#![allow(unsafe_code)]

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use rumple_plugin_abi::{NO_POINT, Report, Status};

use crate::Failure;

thread_local! {
    static IN_CALL: Cell<bool> = const { Cell::new(false) };
    static PANIC_PLACE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs `body` and writes what went wrong to `report`. The cell holds the index of the point that
/// `body` is at.
///
/// # Safety
/// `report` is null or points to a [`Report`] whose buffer has its stated capacity.
pub(crate) unsafe fn guarded(
    report: *mut Report,
    body: impl FnOnce(&Cell<usize>) -> Result<(), Failure>,
) -> Status {
    quiet_panics();
    let point = Cell::new(NO_POINT);
    IN_CALL.set(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| body(&point)));
    IN_CALL.set(false);

    let (status, message, factor) = match outcome {
        Ok(Ok(())) => return Status::OK,
        Ok(Err(Failure::Unreliable(message))) => (Status::UNRELIABLE, message, None),
        Ok(Err(Failure::Retry { factor, message })) => (Status::RETRY, message, Some(factor)),
        Ok(Err(Failure::Fatal(message))) => (Status::FATAL, message, None),
        Err(payload) => (Status::FATAL, panic_message(payload), None),
    };
    // SAFETY: the caller's promise on `report`.
    if let Some(report) = unsafe { report.as_mut() } {
        let length = floor_char_boundary(&message, report.capacity);
        if !report.message.is_null() {
            // SAFETY: the buffer holds `capacity >= length` bytes and is the caller's own.
            unsafe { std::ptr::copy_nonoverlapping(message.as_ptr(), report.message, length) };
            report.length = length;
        }
        report.point = point.get();
        if let Some(factor) = factor {
            report.factor = factor;
        }
    }
    status
}

/// Keeps the message of a panic inside a call for the report instead of standard error. Panics
/// elsewhere in the process still reach the hook that was there before.
fn quiet_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if IN_CALL.get() {
                let place = info.location().map(ToString::to_string);
                PANIC_PLACE.with_borrow_mut(|kept| *kept = place);
            } else {
                before(info);
            }
        }));
    });
}

fn panic_message(payload: Box<dyn Any + Send>) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned());
    // Dropping a payload may panic again, outside of any `catch_unwind`.
    std::mem::forget(payload);
    match PANIC_PLACE.take() {
        Some(place) => format!("panicked at {place}: {text}"),
        None => format!("panicked: {text}"),
    }
}

fn floor_char_boundary(text: &str, limit: usize) -> usize {
    if text.len() <= limit {
        return text.len();
    }
    (0..=limit).rev().find(|&end| text.is_char_boundary(end)).unwrap_or(0)
}
