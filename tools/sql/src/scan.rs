//! The step of a query's plan that reads a table of the store.

use std::fmt;
use std::sync::Arc;

use datafusion::common::stats::Precision;
use datafusion::common::tree_node::TreeNodeRecursion;
use datafusion::common::{Result, Statistics};
use datafusion::execution::{SendableRecordBatchStream, TaskContext};
use datafusion::physical_expr::{EquivalenceProperties, PhysicalExpr};
use datafusion::physical_plan::execution_plan::{Boundedness, EmissionType};
use datafusion::physical_plan::metrics::{
    BaselineMetrics, ExecutionPlanMetricsSet, MetricBuilder, MetricsSet,
};
use datafusion::physical_plan::statistics::StatisticsArgs;
use datafusion::physical_plan::stream::RecordBatchStreamAdapter;
use datafusion::physical_plan::{
    DisplayAs, DisplayFormatType, ExecutionPlan, Partitioning, PlanProperties,
};
use tetdb::{Error, Store};
use tetdb_arrow::{Chunk, Scan};

use super::table::{Readers, outward};

/// Reads a table: the chunks that its condition leaves, shared among partitions.
#[derive(Debug)]
pub(crate) struct StoreScan {
    readers: Readers,
    scan: Scan,
    /// Chunks of each partition, one after the other in the store; one empty list for tables without chunks.
    partitions: Vec<Vec<Chunk>>,
    n_chunks_all: u64,
    /// Rows, where the catalog has their number.
    n_rows: Option<usize>,
    properties: Arc<PlanProperties>,
    metrics: ExecutionPlanMetricsSet,
}

impl StoreScan {
    /// Errors: damage.
    pub fn new(readers: Readers, scan: Scan, store: &mut Store) -> Result<Self, Error> {
        let schema = scan.schema(store)?;
        let n_rows = scan.n_rows(store).map(|n| (n as usize).min(scan.most()));
        let (chunks, n_chunks_all) = scan.chunks(store)?;
        // A limited scan ends early: other partitions would read what nobody takes.
        let n = if scan.most() < usize::MAX { 1 } else { readers.n_max };
        let per_partition = chunks.len().div_ceil(n.max(1)).max(1);
        let mut partitions: Vec<Vec<Chunk>> =
            chunks.chunks(per_partition).map(<[Chunk]>::to_vec).collect();
        if partitions.is_empty() {
            partitions.push(Vec::new());
        }
        let properties = PlanProperties::new(
            EquivalenceProperties::new(schema),
            Partitioning::UnknownPartitioning(partitions.len()),
            EmissionType::Incremental,
            Boundedness::Bounded,
        );
        let (properties, metrics) = (Arc::new(properties), ExecutionPlanMetricsSet::new());
        Ok(Self { readers, scan, partitions, n_chunks_all, n_rows, properties, metrics })
    }

    fn n_chunks(&self) -> usize {
        self.partitions.iter().map(Vec::len).sum()
    }
}

impl DisplayAs for StoreScan {
    fn fmt_as(&self, _: DisplayFormatType, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "StoreScan: {}", self.scan)?;
        if self.n_chunks_all > 0 {
            write!(f, ", chunks={} of {}", self.n_chunks(), self.n_chunks_all)?;
        }
        Ok(())
    }
}

impl ExecutionPlan for StoreScan {
    fn name(&self) -> &'static str {
        "StoreScan"
    }

    fn properties(&self) -> &Arc<PlanProperties> {
        &self.properties
    }

    fn children(&self) -> Vec<&Arc<dyn ExecutionPlan>> {
        Vec::new()
    }

    fn apply_expressions(
        &self,
        _: &mut dyn FnMut(&Arc<dyn PhysicalExpr>) -> Result<TreeNodeRecursion>,
    ) -> Result<TreeNodeRecursion> {
        Ok(TreeNodeRecursion::Continue)
    }

    fn with_new_children(
        self: Arc<Self>,
        _: Vec<Arc<dyn ExecutionPlan>>,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        Ok(self)
    }

    /// Reads on the thread that asks for the next batch: DataFusion gives each partition a task.
    fn execute(&self, partition: usize, _: Arc<TaskContext>) -> Result<SendableRecordBatchStream> {
        let baseline = BaselineMetrics::new(&self.metrics, partition);
        let counter = |name| MetricBuilder::new(&self.metrics).counter(name, partition);
        let (read, skipped) = (counter("chunks_read"), counter("chunks_skipped"));
        if partition == 0 {
            skipped.add((self.n_chunks_all as usize).saturating_sub(self.n_chunks()));
        }
        let chunks = self.partitions[partition].clone();
        let is_chunked = self.n_chunks_all > 0;
        let scan = if is_chunked { self.scan.clone().only(chunks) } else { self.scan.clone() };
        let readers = self.readers.clone();
        let mut waiting = Some(scan);
        let mut open = None;
        let batches = std::iter::from_fn(move || {
            let _timer = baseline.elapsed_compute().timer();
            if let Some(scan) = waiting.take() {
                let store = Store::open_with(&readers.path, readers.settings.clone());
                match store.and_then(|store| scan.open(store)) {
                    Ok(batches) => open = Some(batches),
                    Err(error) => return Some(Err(outward(error))),
                }
            }
            let batch = open.as_mut()?.read_chunk()?;
            if is_chunked {
                read.add(1);
            }
            if let Ok(batch) = &batch {
                baseline.record_output(batch.num_rows());
            }
            Some(batch.map_err(outward))
        });
        let stream = futures::stream::iter(batches);
        Ok(Box::pin(RecordBatchStreamAdapter::new(self.schema(), stream)))
    }

    fn metrics(&self) -> Option<MetricsSet> {
        Some(self.metrics.clone_inner())
    }

    /// The number of rows is exact where the catalog has it, so that a count alone reads no mesh.
    fn statistics_from_inputs(
        &self,
        _: &[Arc<Statistics>],
        args: &StatisticsArgs,
    ) -> Result<Arc<Statistics>> {
        let mut all = Statistics::new_unknown(&self.schema());
        if let (Some(n), None) = (self.n_rows, args.partition()) {
            all.num_rows = Precision::Exact(n);
        }
        Ok(Arc::new(all))
    }
}
