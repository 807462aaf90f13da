import { Worker } from "node:worker_threads";

/** What the module at `url` answers to `job` on a thread of its own: a fresh core whose memory has never been larger. */
export async function onThread<Job, Answer>(url: string, job: Job): Promise<Answer> {
  return new Promise((resolve, reject) => {
    const worker = new Worker(new URL(url), { workerData: job });
    worker.once("message", (answer: Answer) => resolve(answer));
    worker.once("error", reject);
    worker.once("exit", (code) => reject(new Error(`the thread ended with ${code}`)));
  });
}
