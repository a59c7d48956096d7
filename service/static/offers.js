/** What this service can do beyond the rest, read from its own contract. */

import { get } from "./api.js";
import { offerExports } from "./take.js";

/** Offer export formats where the service has them. */
export async function install() {
  const { paths } = await get("/openapi.json");
  const route = paths["/v1/fits/{fit_id}/export/{format}"]?.get;
  const formats = route?.parameters.find((/** @type {any} */ one) => one.name === "format")?.schema.enum ?? [];
  if (formats.length > 0) offerExports(formats);
}
