//! A file dropped on the window, with the X drag-and-drop protocol (XDND, version 5).

use x11rb::{
    connection::Connection,
    protocol::{
        Event,
        xproto::{
            Atom, ClientMessageEvent, ConnectionExt, CreateWindowAux, EventMask, PropMode, SELECTION_NOTIFY_EVENT,
            SelectionNotifyEvent, Window, WindowClass,
        },
    },
    rust_connection::RustConnection,
    wrapper::ConnectionExt as _,
};

use super::*;

/// Another program that is the source of the drag.
struct Source {
    server: RustConnection,
    window: Window,
    target: Window,
}

impl Source {
    fn open(display: &Display) -> Self {
        let (server, screen) = RustConnection::connect(Some(&display.name)).unwrap();
        let root = server.setup().roots[screen].root;
        let window = server.generate_id().unwrap();
        let aux = CreateWindowAux::new();
        server.create_window(0, window, root, -10, -10, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &aux).unwrap();
        let target = display.act("search --name Lanternfish").lines().next().unwrap().parse().unwrap();
        Self { server, window, target }
    }

    fn atom(&self, name: &str) -> Atom {
        self.server.intern_atom(false, name.as_bytes()).unwrap().reply().unwrap().atom
    }

    fn tell(&self, message: &str, data: [u32; 5]) {
        let event = ClientMessageEvent::new(32, self.target, self.atom(message), data);
        self.server.send_event(false, self.target, EventMask::NO_EVENT, event).unwrap();
        self.server.flush().unwrap();
    }

    /// Waits for a reply of the window, and meanwhile answers its requests for the file's location.
    fn answer(&self, message: &str, path: &Path) {
        let wanted = self.atom(message);
        wait_for(message, || {
            loop {
                match self.server.poll_for_event().unwrap()? {
                    Event::ClientMessage(answer) if answer.type_ == wanted => return Some(()),
                    Event::SelectionRequest(requested) => {
                        let location = format!("file://{}\r\n", path.display());
                        let (to, property, kind) = (requested.requestor, requested.property, requested.target);
                        self.server
                            .change_property8(PropMode::REPLACE, to, property, kind, location.as_bytes())
                            .unwrap();
                        let given = SelectionNotifyEvent {
                            response_type: SELECTION_NOTIFY_EVENT,
                            sequence: 0,
                            time: requested.time,
                            requestor: to,
                            selection: requested.selection,
                            target: kind,
                            property,
                        };
                        self.server.send_event(false, to, EventMask::NO_EVENT, given).unwrap();
                        self.server.flush().unwrap();
                    }
                    _ => {}
                }
            }
        });
    }

    /// Drags a file to the middle of the window and drops it.
    fn drop(&self, path: &Path) {
        self.server.set_selection_owner(self.window, self.atom("XdndSelection"), x11rb::CURRENT_TIME).unwrap();
        self.tell("XdndEnter", [self.window, 5 << 24, self.atom("text/uri-list"), 0, 0]);
        let position = ((SIZE[0] as u32 / 2) << 16) | (SIZE[1] as u32 / 2);
        let copy = self.atom("XdndActionCopy");
        self.tell("XdndPosition", [self.window, 0, position, x11rb::CURRENT_TIME, copy]);
        self.answer("XdndStatus", path);
        // The requested data arrives after the first reply, as when the pointer moves on.
        self.tell("XdndPosition", [self.window, 0, position + 1, x11rb::CURRENT_TIME, copy]);
        self.answer("XdndStatus", path);
        self.tell("XdndDrop", [self.window, 0, x11rb::CURRENT_TIME, 0, 0]);
        self.answer("XdndFinished", path);
    }
}

/// A blue emissive card of two triangles, in a separate file.
fn write_card(folder: &Path) -> PathBuf {
    let corners = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 0., 0.], [1., 1., 0.], [0., 1., 0.0f32]];
    let bytes: Vec<u8> = corners.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(folder.join("card.bin"), &bytes).unwrap();
    let scene = serde_json::json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
        "materials": [{ "emissiveFactor": [0, 0, 1], "doubleSided": true, "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] } }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "uri": "card.bin", "byteLength": bytes.len() }],
    });
    let path = folder.join("card.gltf");
    fs::write(&path, scene.to_string()).unwrap();
    path
}

/// A dropped scene is opened. Any other file gives an error below the image, which stays.
#[test]
#[ignore = "full"]
fn gpu_a_dropped_file_is_opened() {
    let Some(display) = Display::open("gpu_a_dropped_file_is_opened") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (view, cornell) = open_alone(&display, folder.path(), "--size 400x300");
    let source = Source::open(&display);

    let blue =
        |screen: &[[u8; 3]]| screen.iter().filter(|pixel| pixel[0] > 200 && pixel[1].max(pixel[2]) < 150).count();
    assert_eq!(blue(&cornell), 0);
    source.drop(&write_card(folder.path()));
    let card = display.settled("the card", |screen| 10 * blue(screen) > screen.len());
    assert_eq!(display.act("search --name card.gltf").lines().count(), 1, "the window has the file's name");

    display.act("key F3");
    let panels = display.settled("the panels around it", |screen| !are_alike(screen, &card));
    let text = folder.path().join("text.gltf");
    fs::write(&text, "no scene").unwrap();
    source.drop(&text);
    // An error is a line of text below the image.
    let differing = |screen: &[[u8; 3]]| screen.iter().zip(&panels).filter(|(a, b)| is_other(**a, **b)).count();
    let told = wait_for("what is wrong", || {
        let screen = display.screen();
        (differing(&screen) > 100).then_some(screen)
    });
    let top = SIZE[0] * SIZE[1] * 2 / 3;
    assert!(are_alike(&told[..top], &panels[..top]), "the image stays");
    assert_eq!(display.act("search --name card.gltf").lines().count(), 1, "and the window's name");
    close(&display, view);
}
