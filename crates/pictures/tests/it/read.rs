//! Reading an `.rrd` back.

use std::collections::{BTreeMap, BTreeSet};

use re_sdk::external::re_log_encoding::Decoder;
use re_sdk::external::re_log_types::LogMsg;
use re_sdk::log::Chunk;
use re_sdk::{Component, ComponentDescriptor, StoreKind};

/// What a file holds.
pub(crate) struct Read {
    pub(crate) name: String,
    pub(crate) stores: Vec<&'static str>,
    pub(crate) activated: bool,
    pub(crate) content: Vec<Chunk>,
    pub(crate) page: Vec<Chunk>,
}

impl Read {
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let mut read = Self {
            name: String::new(),
            stores: Vec::new(),
            activated: false,
            content: Vec::new(),
            page: Vec::new(),
        };
        for message in Decoder::<LogMsg>::decode_lazy(bytes) {
            match message.unwrap() {
                LogMsg::SetStoreInfo(info) => match info.info.store_id.kind() {
                    StoreKind::Recording => {
                        read.name = info.info.store_id.recording_id().to_string();
                        read.stores.push("recording");
                    }
                    StoreKind::Blueprint => read.stores.push("blueprint"),
                },
                LogMsg::ArrowMsg(store, message) => {
                    let chunk = Chunk::from_arrow_msg(&message).unwrap();
                    match store.kind() {
                        StoreKind::Recording => read.content.push(chunk),
                        StoreKind::Blueprint => read.page.push(chunk),
                    }
                }
                LogMsg::BlueprintActivationCommand(command) => {
                    read.activated = command.make_active && command.make_default;
                }
            }
        }
        read
    }

    /// Paths of all entities.
    pub(crate) fn entities(&self) -> BTreeSet<String> {
        self.content.iter().map(|c| c.entity_path().to_string()).collect()
    }

    /// All values of a component of an entity: one list for each row, static data first under no time.
    pub(crate) fn values<C: Component>(
        &self,
        entity: &str,
        what: &ComponentDescriptor,
    ) -> Vec<(Option<i64>, Vec<C>)> {
        let mut rows = Vec::new();
        for chunk in self.content.iter().filter(|c| c.entity_path().to_string() == entity) {
            let times: Vec<Option<i64>> = match chunk.timelines().values().next() {
                Some(column) => column.times_raw().iter().map(|t| Some(*t)).collect(),
                None => vec![None; chunk.num_rows()],
            };
            for (row, time) in times.into_iter().enumerate() {
                if let Some(batch) = chunk.component_batch::<C>(what.component, row) {
                    rows.push((time, batch.unwrap()));
                }
            }
        }
        rows
    }

    /// The one value of a static component.
    pub(crate) fn fixed<C: Component>(&self, entity: &str, what: &ComponentDescriptor) -> Vec<C> {
        let mut rows = self.values(entity, what);
        assert_eq!(rows.len(), 1, "{entity} {what}: rows");
        let (time, values) = rows.remove(0);
        assert_eq!(time, None, "{entity} {what} is static");
        values
    }

    /// Names of all time axes, with the number of chunks on each.
    pub(crate) fn axes(&self) -> BTreeMap<String, usize> {
        let mut axes = BTreeMap::new();
        for name in self.content.iter().flat_map(|c| c.timelines().values()) {
            *axes.entry(name.name().to_string()).or_default() += 1;
        }
        axes
    }

    /// The text of the summary.
    pub(crate) fn summary(&self) -> String {
        let text = self.fixed::<re_sdk_types::components::Text>(
            "/summary",
            &re_sdk_types::archetypes::TextDocument::descriptor_text(),
        );
        text[0].to_string()
    }

    /// Display names of the views of the page, with their class.
    pub(crate) fn views(&self) -> Vec<(String, String)> {
        use re_sdk_types::blueprint::archetypes::ViewBlueprint;
        use re_sdk_types::blueprint::components::ViewClass;
        let text = |chunk: &Chunk| {
            let class = chunk
                .component_batch::<ViewClass>(ViewBlueprint::descriptor_class_identifier().component, 0)?
                .unwrap();
            let name = chunk
                .component_batch::<re_sdk_types::components::Name>(
                    ViewBlueprint::descriptor_display_name().component,
                    0,
                )?
                .unwrap();
            Some((class[0].0.to_string(), name[0].to_string()))
        };
        self.page.iter().filter_map(text).collect()
    }
}
