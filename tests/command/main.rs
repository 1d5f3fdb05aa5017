//! The command: its words, messages and exit codes, and the pages that it writes, in a browser.

mod browser;
mod cli;
mod compare;
mod compare_page;
mod drivers;
mod study;
mod study_page;
