//! The command: arguments, messages and exit codes, and its pages in a browser.

mod browser;
mod cli;
mod compare;
mod compare_page;
mod drivers;
mod farm;
mod layers;
mod passes;
mod study;
mod study_page;
