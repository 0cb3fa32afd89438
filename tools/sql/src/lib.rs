//! Questions to a finished store in SQL: the tables of `tetdb-arrow` behind DataFusion.
//!
//! Filters go to the store as a condition as far as its language says them, so that chunks which cannot have answers are not read. Columns
//! that a query does not name are not computed. A query only reads: statements that change anything are refused.
//!
//! Memory: half of the cap for readers of the store, half for DataFusion, which sorts and joins beyond that through temporary files.
//! Without ORDER BY the order of rows is not fixed, and sums of floating-point numbers may differ in their last bits with the number of
//! threads.
//!
//! Reading order: `database` (the front door), `failure` (errors), `condition` (filters in the store's language), `table`, `scan` (the step
//! of a plan that reads).

mod condition;
mod database;
mod failure;
mod scan;
mod table;

pub use database::Database;
