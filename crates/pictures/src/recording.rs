//! Recordings: the content of an `.rrd` file, with ids from a counter instead of a clock.
//!
//! The stream of Rerun uses clock time and random ids for chunks, rows and stores. Here chunk k has the id (k, 0) and its rows (k, 1),
//! (k, 2), …; the store is named by the SHA-256 of its content. The same result gives the same bytes, and different results do not
//! merge in a viewer.

use std::path::Path;
use std::time::Duration;

use re_sdk::external::re_log_encoding::Encoder;
use re_sdk::external::re_log_types::external::re_tuid::Tuid;
use re_sdk::external::re_log_types::{
    BlueprintActivationCommand, LogMsg, SetStoreInfo, StoreInfo, StoreSource, TimePoint,
};
use re_sdk::log::{Chunk, TimeColumn};
use re_sdk::sink::{GrpcSink, LogSink};
use re_sdk::{
    AsComponents, EntityPath, RecordingInfo, SerializedComponentBatch, SerializedComponentColumn, StoreId,
    StoreKind,
};
use re_sdk_types::external::re_types_core::{ChunkId, RowId};
use sha2::{Digest, Sha256};
use thiserror::Error;
use truegrind_math::digest::hex;

/// Default address of a Rerun viewer.
pub const VIEWER: &str = re_sdk::DEFAULT_CONNECT_URL;

/// Timeout for a viewer to accept a recording.
const PATIENCE: Duration = Duration::from_secs(10);

/// Error of making or showing a recording.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum VisualError {
    /// There is nothing to draw.
    #[error("there is nothing to draw: {0}")]
    Empty(&'static str),
    /// Rerun rejected the content.
    #[error("the recording cannot be encoded: {0}")]
    Encoding(String),
    /// Invalid address of a viewer.
    #[error("{url} is no address of a Rerun viewer ({problem}); expected one such as {VIEWER}")]
    Address {
        /// The address.
        url: String,
        /// The problem.
        problem: String,
    },
    /// No viewer responds.
    #[error(
        "no Rerun viewer accepts the recording at {url} ({problem}); start one with `rerun`, or write an .rrd file"
    )]
    Viewer {
        /// The address.
        url: String,
        /// The problem.
        problem: String,
    },
    /// The viewer cannot be started.
    #[error(
        "the Rerun viewer cannot be started ({0}); install it with `pip install rerun-sdk` or \
         `cargo install rerun-cli`, so that `rerun` is on the path, or write an .rrd file"
    )]
    Start(String),
}

/// A finished recording; see the module documentation.
#[derive(Debug, Clone)]
pub struct Recording {
    messages: Vec<LogMsg>,
}

impl Recording {
    /// The bytes of an `.rrd` file.
    ///
    /// # Errors
    /// [`VisualError::Encoding`]; not known to happen.
    pub fn rrd(&self) -> Result<Vec<u8>, VisualError> {
        encoded(&self.messages)
    }

    /// Sends the recording to the viewer at `url`, such as [`VIEWER`].
    ///
    /// # Errors
    /// [`VisualError::Address`] and [`VisualError::Viewer`].
    pub fn connect(&self, url: &str) -> Result<(), VisualError> {
        let address =
            url.parse().map_err(|e| VisualError::Address { url: url.to_owned(), problem: format!("{e}") })?;
        let sink = GrpcSink::new(address);
        sink.send_all(self.messages.clone());
        sink.flush_blocking(PATIENCE)
            .map_err(|e| VisualError::Viewer { url: url.to_owned(), problem: e.to_string() })
    }

    /// Sends the recording to the viewer at [`VIEWER`], which is started if needed.
    ///
    /// # Errors
    /// [`VisualError::Start`] and [`VisualError::Viewer`].
    pub fn spawn(&self) -> Result<(), VisualError> {
        let options =
            re_sdk::SpawnOptions { wait_for_bind: true, hide_welcome_screen: true, ..Default::default() };
        re_sdk::spawn(&options).map_err(|e| VisualError::Start(first_line(&e.to_string())))?;
        self.connect(VIEWER)
    }

    /// Opens an `.rrd` file in a new viewer.
    ///
    /// # Errors
    /// [`VisualError::Start`].
    pub fn open(file: &Path) -> Result<(), VisualError> {
        let options = re_sdk::SpawnOptions {
            new: true,
            hide_welcome_screen: true,
            extra_args: vec![file.display().to_string()],
            ..Default::default()
        };
        re_sdk::spawn(&options).map(drop).map_err(|e| VisualError::Start(first_line(&e.to_string())))
    }

    /// Combines content and layout. `application` separates the layouts of different kinds of recordings.
    pub(super) fn new(
        application: &'static str,
        name: &str,
        mut content: Store,
        page: Store,
    ) -> Result<Self, VisualError> {
        content.fixed(EntityPath::properties(), &RecordingInfo::new().with_name(name))?;
        let mut messages = content.messages(StoreKind::Recording, application)?;
        let page = page.messages(StoreKind::Blueprint, application)?;
        let activation = page.first().map(|m| BlueprintActivationCommand::make_active(m.store_id().clone()));
        messages.extend(page);
        messages.extend(activation.map(LogMsg::from));
        Ok(Self { messages })
    }
}

/// First line of an error; the longer messages of Rerun contain advice.
fn first_line(message: &str) -> String {
    message.lines().next().unwrap_or_default().trim().to_owned()
}

/// Removes the index that Rerun appends, whose order is that of a hash map and differs from run to run; viewers build their own.
fn encoded(messages: &[LogMsg]) -> Result<Vec<u8>, VisualError> {
    let mut encoder = Encoder::local().map_err(encoding)?;
    encoder.do_not_emit_footer();
    for message in messages {
        encoder.append(message).map_err(encoding)?;
    }
    encoder.finish().map_err(encoding)?;
    encoder.into_inner().map_err(encoding)
}

fn encoding(error: impl std::fmt::Display) -> VisualError {
    VisualError::Encoding(error.to_string())
}

/// Logged entities, in order.
#[derive(Debug, Default)]
pub(super) struct Store {
    chunks: Vec<Chunk>,
}

impl Store {
    fn next_id(&self) -> ChunkId {
        ChunkId::from_tuid(Tuid::from_nanos_and_inc(self.chunks.len() as u64 + 1, 0))
    }

    fn row(
        &mut self,
        path: impl Into<EntityPath>,
        time: TimePoint,
        batches: impl IntoIterator<Item = SerializedComponentBatch>,
    ) -> Result<(), VisualError> {
        let id = self.next_id();
        let row = RowId::from_tuid(id.as_tuid().next());
        let chunk = Chunk::builder_with_id(id, path)
            .with_serialized_batches(row, time, batches)
            .build()
            .map_err(encoding)?;
        self.chunks.push(chunk);
        Ok(())
    }

    /// Logs static data.
    pub(super) fn fixed(
        &mut self,
        path: impl Into<EntityPath>,
        what: &dyn AsComponents,
    ) -> Result<(), VisualError> {
        self.row(path, TimePoint::default(), what.as_serialized_batches())
    }

    /// Logs data valid from a time on.
    pub(super) fn at(
        &mut self,
        path: impl Into<EntityPath>,
        (axis, time): (&'static str, i64),
        batches: impl IntoIterator<Item = SerializedComponentBatch>,
    ) -> Result<(), VisualError> {
        let axis = re_sdk::Timeline::new_sequence(axis);
        self.row(path, TimePoint::default().with(axis, time), batches)
    }

    /// Logs time-dependent data: one row of `columns` for each of `times`.
    pub(super) fn over(
        &mut self,
        path: impl Into<EntityPath>,
        (axis, times): (&'static str, &[i64]),
        columns: impl IntoIterator<Item = SerializedComponentColumn>,
    ) -> Result<(), VisualError> {
        if times.is_empty() {
            return Ok(());
        }
        let time = TimeColumn::new_sequence(axis, times.iter().copied());
        let timelines = std::iter::once((*time.timeline().name(), time)).collect();
        let components = columns.into_iter().map(|c| (c.descriptor, c.list_array)).collect();
        let chunk =
            Chunk::from_auto_row_ids(self.next_id(), path.into(), timelines, components).map_err(encoding)?;
        self.chunks.push(chunk);
        Ok(())
    }

    /// The store as messages; the first one names it.
    fn messages(self, kind: StoreKind, application: &'static str) -> Result<Vec<LogMsg>, VisualError> {
        let name = |id: &str| StoreId::new(kind, application, id.to_owned());
        let messages_of = |store: &StoreId| {
            let arrow = |c: &Chunk| Ok(LogMsg::ArrowMsg(store.clone(), c.to_arrow_msg().map_err(encoding)?));
            self.chunks.iter().map(arrow).collect::<Result<Vec<_>, _>>()
        };
        let bytes = encoded(&messages_of(&name("content"))?)?;
        let digest = hex(&Sha256::digest(&bytes)[..16]);
        let store_id = name(&digest);
        let source = StoreSource::Other("truegrind".to_owned());
        let info = StoreInfo::new(store_id.clone(), source);
        let mut messages = vec![LogMsg::SetStoreInfo(SetStoreInfo { row_id: Tuid::ZERO, info })];
        messages.extend(messages_of(&store_id)?);
        Ok(messages)
    }
}
