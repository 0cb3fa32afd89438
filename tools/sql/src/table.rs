//! A table of the store as DataFusion sees it.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use arrow::datatypes::{DataType, SchemaRef};
use async_trait::async_trait;
use datafusion::catalog::{Session, TableProvider};
use datafusion::common::{DataFusionError, Result};
use datafusion::logical_expr::{Expr, TableProviderFilterPushDown, TableType};
use datafusion::physical_plan::ExecutionPlan;
use tetdb::{Error, Settings, Store, VARIABLES};
use tetdb_arrow::{Scan, Table};

use super::condition::{Column, Columns, Condition, translate};
use super::scan::StoreScan;

/// How stores are opened for reading a table.
#[derive(Clone, Debug)]
pub(crate) struct Readers {
    pub path: PathBuf,
    /// Settings of each reader: its share of the memory.
    pub settings: Settings,
    /// Most readers of one table at the same time.
    pub n_max: usize,
}

/// A table of the store.
pub(crate) struct StoreTable {
    readers: Readers,
    /// Answers what is asked while a query is planned.
    store: Arc<Mutex<Store>>,
    table: Table,
    schema: SchemaRef,
    columns: Columns,
}

impl fmt::Debug for StoreTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StoreTable").field("table", &self.table).finish_non_exhaustive()
    }
}

/// An error on its way through DataFusion.
pub(crate) fn outward(error: Error) -> DataFusionError {
    DataFusionError::External(Box::new(error))
}

impl StoreTable {
    /// Errors: damage.
    pub fn new(readers: Readers, store: &Arc<Mutex<Store>>, table: Table) -> Result<Self, Error> {
        let known = store.lock().unwrap_or_else(PoisonError::into_inner);
        let schema = table.schema(&known)?;
        let mut columns = Columns::new();
        if table == Table::Tets {
            let fields = known.fields()?;
            for column in schema.fields() {
                let name = column.name();
                let of_field = fields.iter().find_map(|field| {
                    let component = field.columns.iter().position(|c| c == name)?;
                    Some(field.ranges[component].nan > 0)
                });
                // Summaries of chunks take the shapes of tetrahedra for numbers, and so may this.
                let has_nan = match VARIABLES.contains(&name.as_str()) {
                    true => Some(false),
                    false => of_field,
                };
                if let Some(has_nan) = has_nan {
                    let number: DataType = column.data_type().clone();
                    columns.insert(name.clone(), Column { number, has_nan });
                }
            }
        }
        drop(known);
        Ok(Self { readers, store: Arc::clone(store), table, schema, columns })
    }

    /// The condition of filters, as far as the store takes it; for each filter its own condition.
    fn condition(&self, filters: &[&Expr]) -> Result<(Option<String>, Vec<Option<Condition>>)> {
        let store = self.store.lock().unwrap_or_else(PoisonError::into_inner);
        let mut whole: Option<String> = None;
        let mut each = Vec::new();
        for filter in filters {
            let mut own = translate(filter, &self.columns);
            if let Some(condition) = &own {
                let longer = match &whole {
                    Some(whole) => format!("{whole} and {}", condition.text),
                    None => condition.text.clone(),
                };
                // A text may be too long.
                match store.condition(&longer).map_err(outward)? {
                    Ok(_) => whole = Some(longer),
                    Err(_) => own = None,
                }
            }
            each.push(own);
        }
        Ok((whole, each))
    }
}

#[async_trait]
impl TableProvider for StoreTable {
    fn schema(&self) -> SchemaRef {
        Arc::clone(&self.schema)
    }

    fn table_type(&self) -> TableType {
        TableType::Base
    }

    fn supports_filters_pushdown(
        &self,
        filters: &[&Expr],
    ) -> Result<Vec<TableProviderFilterPushDown>> {
        let (_, each) = self.condition(filters)?;
        let support = each.iter().map(|condition| match condition {
            Some(Condition { is_exact: true, .. }) => TableProviderFilterPushDown::Exact,
            Some(_) => TableProviderFilterPushDown::Inexact,
            None => TableProviderFilterPushDown::Unsupported,
        });
        Ok(support.collect())
    }

    async fn scan(
        &self,
        _: &dyn Session,
        projection: Option<&Vec<usize>>,
        filters: &[Expr],
        limit: Option<usize>,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        let (condition, _) = self.condition(&filters.iter().collect::<Vec<_>>())?;
        let mut scan = Scan::new(self.table);
        if let Some(places) = projection {
            let names = places.iter().map(|&i| self.schema.field(i).name());
            scan = scan.columns(&names.collect::<Vec<_>>());
        }
        if let Some(text) = condition {
            scan = scan.condition(text);
        }
        if let Some(n) = limit {
            scan = scan.limit(n);
        }
        let mut store = self.store.lock().unwrap_or_else(PoisonError::into_inner);
        let plan = StoreScan::new(self.readers.clone(), scan, &mut store).map_err(outward)?;
        Ok(Arc::new(plan))
    }
}
