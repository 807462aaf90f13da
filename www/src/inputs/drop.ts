import { byId } from "../dom.js";
import { InputFileError } from "../input-file-error.js";
import { messageOf } from "../message-of.js";
import type { InputLoader } from "./load-inputs.js";
import { slotNames, type SlotName } from "../state.js";

/** A file dropped on a card is loaded there. Several files, folders, and files dropped elsewhere are assigned by name. */
export function bindDrop(loader: InputLoader): void {
  const veil = byId("drop-veil", HTMLElement);
  let over: Element | null = null;
  const mark = (card: Element | null, shown: boolean) => {
    if (card !== over) over?.classList.remove("over");
    over = card;
    over?.classList.add("over");
    veil.hidden = !shown || card !== null;
  };

  window.addEventListener("dragover", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
    mark(cardOf(event), true);
  });
  window.addEventListener("dragleave", (event) => {
    // The pointer left the window rather than an element.
    if (event.relatedTarget === null) mark(null, false);
  });
  window.addEventListener("drop", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    const slot = slotOf(cardOf(event));
    mark(null, false);
    filesOf(event.dataTransfer)
      .then((files) => {
        const [file] = files;
        if (slot && file && files.length === 1) return loader.loadOne(slot, file);
        return loader.loadMany(files);
      })
      .catch((error: unknown) => loader.refuse(error));
  });
}

function cardOf(event: DragEvent): Element | null {
  return event.target instanceof Element ? event.target.closest("[data-slot]") : null;
}

function slotOf(card: Element | null): SlotName | undefined {
  return slotNames.find((slot) => slot === card?.getAttribute("data-slot"));
}

/** The dropped files, including those in dropped folders but not in their subfolders. */
async function filesOf(transfer: DataTransfer): Promise<File[]> {
  // Both lists are emptied after the event, so they are read before the first await.
  const files = [...transfer.files];
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry());
  const folders = entries.filter(isFolder);
  if (folders.length === 0) return files;
  const inFolders = await Promise.all(folders.map(filesIn)).catch((error: unknown) => {
    throw new InputFileError(`A folder could not be read: ${messageOf(error)}`);
  });
  const loose = files.filter((file) => !folders.some((folder) => folder.name === file.name));
  return [...loose, ...inFolders.flat()];
}

async function filesIn(folder: FileSystemDirectoryEntry): Promise<File[]> {
  const reader = folder.createReader();
  const files: File[] = [];
  // The reader returns at most a hundred entries per call.
  for (;;) {
    const batch = await new Promise<FileSystemEntry[]>((resolve, reject) => {
      reader.readEntries(resolve, reject);
    });
    if (batch.length === 0) return files;
    for (const entry of batch) {
      if (!isFile(entry)) continue;
      files.push(await new Promise<File>((resolve, reject) => entry.file(resolve, reject)));
    }
  }
}

// Some browsers do not expose these classes as globals.
function isFolder(entry: FileSystemEntry | null): entry is FileSystemDirectoryEntry {
  return entry?.isDirectory === true;
}

function isFile(entry: FileSystemEntry): entry is FileSystemFileEntry {
  return entry.isFile;
}
